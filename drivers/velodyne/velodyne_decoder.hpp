#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/arrival_watch.hpp"
#include "drivers/gap_trial.hpp"
#include "drivers/message_counter.hpp"
#include "drivers/velodyne/velodyne_model.hpp"
#include "drivers/velodyne/velodyne_position.hpp"
#include "drivers/velodyne/velodyne_timing.hpp"

namespace hueline::drivers {

/// Which returns of a firing are kept, for a scanner in dual-return mode.
enum class ReturnChoice : std::uint8_t {
  All,        ///< both; a pair with the same range is one return
  Strongest,  ///< the one with the higher reflectivity
  Last,       ///< the one that the scanner reports as last
};

/// The firing of a data packet that its time stamp names. VLP-16 User Manual 9.3.1 says the first firing of the packet.
/// The HDL-32E manual of 2011 (appendix E) says the last; later firmware and other decoders use the first. The two are
/// 0.54 ms apart, which is 1 cm at 70 km/h.
enum class PacketStamp : std::uint8_t { FirstFiring, LastFiring };

class VelodyneKernel;
struct VelodyneBlocks;

/// Decodes the packets of the scanners in VelodyneModel. Each data packet gives one LaserBatch, even if no return is
/// left. Each position packet gives a LaserStatus and, once a second, a TimeLabel. The two kinds differ in size, so one
/// UDP source may carry both ports.
///
/// LaserBatch::time is the first firing of the packet, in the scanner's microseconds past the UTC hour. A return has
/// the time and the azimuth of its own firing. The azimuth is interpolated between two blocks; after the last block it
/// goes on at the packet's own rate, so a lost packet does not change its neighbours. Frame: Scanner (z up, y forward
/// at azimuth 0, x right; azimuth clockwise seen from above). return_number counts by range; 1 is the nearer one.
///
/// Config names the model, and the timing of the packets has to agree with it (VelodyneTiming). If it does, a factory
/// byte of another model is accepted. The first packets with such a byte, at most 16, are held until the timing is
/// known.
///
/// Faults:
/// - Malformed: wrong size, flag, return mode, azimuth or counter.
/// - WrongDevice: a packet of another model.
/// - Lost: packets missing between two stamps, reported 0.1 s later, because a packet that was overtaken fills the gap.
/// - NoTime: blocks behind a jump of the azimuth, if the next packet is missing or does not continue them.
/// - Silent: nothing came for a while, and what was sent then comes late (ArrivalWatch).
/// - ClockStep: the stamp jumped relative to the arrival.
/// - Late: a packet that is older than the one before.
/// - Spurious: the same packet came again.
/// - LabelConflict: the counter and the RMC sentence disagree.
///
/// A scanner that is set to a field of view sends nothing over the rest of the circle. The first packet whose azimuth
/// jumps over that part shows where it is. From then on the time of turning through it does not count as lost packets.
/// The blocks behind such a jump are dated by the stamp of the next packet, whose azimuth continues theirs, and come as
/// a batch of their own before that packet's.
///
/// Thread safety: none; one thread calls all functions.
/// Sources: VLP-16 User Manual 63-9243 chapter 9, HDL-32E User's Manual, those of VLP-32C and VLS-128.
class VelodyneDecoder final : public Decoder {
 public:
  struct Config {
    VelodyneModel model = VelodyneModel::Vlp16;
    ReturnChoice returns = ReturnChoice::All;
    double min_range_m = 0.5;  ///< nearer returns are dropped, such as those of the housing and the vehicle's roof
    std::optional<double> max_range_m;  ///< farther returns are dropped; without it all are kept
    /// The azimuths that are kept, rad, clockwise from begin to end (through 0 if end < begin). The default keeps all.
    double azimuth_begin = 0;
    double azimuth_end = 6.283185307179586;
    PacketStamp stamp = PacketStamp::FirstFiring;
    /// The directions of the lasers in the order of the packet, from the scanner's own calibration file, in the senses
    /// of VelodyneLaser. Both are empty for the nominal directions.
    std::vector<double> elevations_deg, azimuths_deg;
    /// Heights of the beams' origins, from the same file. Empty: the model's.
    std::vector<double> vertical_offsets_mm;
    /// Whether gaps between stamps are reported as lost packets. Set it to false if the scanner itself leaves out
    /// packets.
    bool detects_lost = true;

    void visit(Keys& keys);
    KeyError validate() const;
  };

  explicit VelodyneDecoder(const Config& config);
  ~VelodyneDecoder() override;
  VelodyneDecoder(const VelodyneDecoder&) = delete;
  VelodyneDecoder& operator=(const VelodyneDecoder&) = delete;

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void flush(std::vector<Measurement>& out) override;
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }

 private:
  void decode_data(const Packet& packet, std::vector<Measurement>& out);
  bool is_ours(const Packet& packet, std::vector<Measurement>& out);
  void judge_held(bool are_ours, std::vector<Measurement>& out);
  void wrong_device(const Packet& packet, std::vector<Measurement>& out);
  void use_data(const Packet& packet, std::vector<Measurement>& out);
  void decode_position_packet(const Packet& packet, std::vector<Measurement>& out);
  void label(const Packet& packet, const VelodynePosition& position, const RmcSentence& rmc,
             std::vector<Measurement>& out);
  void check_gap(const Packet& packet, nanoseconds stamp, nanoseconds duration, const VelodyneBlocks& blocks,
                 std::vector<Measurement>& out);
  void hold_behind(const Packet& packet, const VelodyneBlocks& blocks);
  void date_behind(std::span<const std::byte> next, nanoseconds first_firing, std::vector<Measurement>& out);
  void refuse_behind(std::vector<Measurement>& out);
  void learn_turn_rate(std::span<const std::byte> bytes, nanoseconds stamp);
  void learn_silent_part(const VelodyneBlocks& blocks);
  void tell_lost(const GapTrial::Lost& lost, HostTime time, std::vector<Measurement>& out) const;
  void malformed(const Packet& packet, std::size_t bytes, const std::string& what, std::vector<Measurement>& out);

  SensorId sensor_ = kSystemSensor;  // of the packet that is decoded, or was last
  Config config_;
  const VelodyneTable& table_;
  std::unique_ptr<VelodyneKernel> kernel_;
  DecodeCounts counts_;
  MessageCounter data_;  ///< of the packets of points

  struct Previous {
    nanoseconds stamp;
    nanoseconds duration;
    HostTime received;
    nanoseconds travelled;  ///< of the counter, from the first packet to this one
    int azimuth;            ///< of the first block, 0.01 degrees
    double turn_rate;       ///< 0.01 degrees a second
  };
  /// The part of the circle over which the scanner itself sends nothing, in 0.01 degrees.
  struct SilentPart {
    int begin, width;
  };
  /// The returns behind a jump of the azimuth, until the next packet dates them.
  struct Behind {
    LaserBatch batch;
    nanoseconds duration;  ///< of their blocks, up to the next packet's first firing
    int blocks;
    int begin_azimuth, last_azimuth;  ///< in front of the jump, and of the last block behind it, 0.01 degrees
    int jump_azimuth;
    double turn_rate;
  };
  nanoseconds silent_time(const Previous& from, nanoseconds moved) const;

  std::map<std::uint8_t, VelodyneTiming> timings_;  // by factory byte, because two scanners may send to one port
  std::vector<Packet> held_;  // packets with a factory byte of another model, until their timing is known
  std::optional<bool> is_other_byte_ours_;
  std::optional<SilentPart> silent_part_;
  std::optional<Behind> behind_;
  double turn_rate_ = 0;                        // of the latest packets, 0.01 degrees a second
  std::array<std::byte, 1206> newest_bytes_{};  // the latest data packet, to recognise a copy of it
  std::optional<Previous> previous_;
  ArrivalWatch arrivals_;
  GapTrial gaps_;             // positions are Previous::travelled, ns
  std::uint64_t broken_ = 0;  // broken data packets since the last good one; they came, so they are not lost
  std::optional<TimeLabel> last_label_;
};

}  // namespace hueline::drivers
