#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/gap_trial.hpp"
#include "drivers/velodyne/velodyne_model.hpp"
#include "drivers/velodyne/velodyne_position.hpp"
#include "drivers/velodyne/velodyne_timing.hpp"

namespace hueline::drivers {

/// Which returns of a firing to keep, of a scanner in dual-return mode.
enum class ReturnChoice : std::uint8_t {
  All,        ///< both; a pair with the same range is one return
  Strongest,  ///< the one with the higher reflectivity
  Last,       ///< the one that the scanner reports as last
};

/// Which firing of a data packet its stamp names. VLP-16 User Manual 9.3.1: the first of the packet. The HDL-32E manual
/// of 2011 (appendix E) says the last; later firmware and other decoders hold it for the first. 0.54 ms apart: 1 cm at
/// 70 km/h.
enum class PacketStamp : std::uint8_t { FirstFiring, LastFiring };

class VelodyneKernel;
struct VelodyneBlocks;

/// VLP-16 and HDL-32E: data packets -> LaserBatch (one each, also when no return is left), position packets ->
/// LaserStatus and, once a second, TimeLabel. The two are told apart by their size, so one UDP source may carry both
/// ports.
///
/// LaserBatch::time is the first firing of the packet in the scanner's microseconds past the UTC hour; a return's time
/// and azimuth are those of its own firing: the azimuth between two blocks is interpolated, the last block is continued
/// at the packet's own rate, so a lost packet changes nothing in its neighbours. Frame: Scanner (z up, y forward at
/// azimuth 0, x right; azimuth clockwise seen from above). return_number counts by range: 1 is the nearer.
///
/// The model is what Config says, and the packets' timing has to agree (VelodyneTiming): a factory byte of another
/// model is passed over where it does. The first packets with such a byte are held until that is known, sixteen at
/// most.
///
/// Faults: Malformed (wrong size, flag, mode, azimuth, counter), WrongDevice (factory byte of another
/// model), Lost (packets by the stamps' gap, 0.1 s after it: one that was overtaken fills it), NoTime (blocks behind an
/// azimuth jump), ClockStep (the stamp moved against the arrival), Late (an older packet after a newer), LabelConflict
/// (counter and RMC disagree).
///
/// A scanner that is set to a field of view sends nothing over the rest of the circle. The first packet that goes on
/// behind it, so that its azimuth jumps, tells which part that is; from then on the time of turning through it is not
/// taken for lost packets. Thread-bound. Source: VLP-16 User Manual 63-9243 chapter 9, HDL-32E User's Manual.
class VelodyneDecoder final : public Decoder {
 public:
  struct Config {
    VelodyneModel model = VelodyneModel::Vlp16;
    ReturnChoice returns = ReturnChoice::All;
    double min_range_m = 0.5;  ///< nearer returns are dropped: the housing, the vehicle's roof
    double max_range_m = 130;
    /// Azimuths kept, rad, clockwise from begin to end (through 0 if end < begin). [0, 2 pi): everything.
    double azimuth_begin = 0;
    double azimuth_end = 6.283185307179586;
    PacketStamp stamp = PacketStamp::FirstFiring;
    /// Lost packets are seen from gaps between stamps. False where the scanner itself leaves out packets.
    bool detects_lost = true;

    void visit(Keys& keys);
    KeyError validate() const;
  };

  VelodyneDecoder(SensorId sensor, const Config& config);
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
  void learn_silent_part(const VelodyneBlocks& blocks);
  void tell_lost(const GapTrial::Lost& lost, HostTime time, std::vector<Measurement>& out) const;
  void malformed(const Packet& packet, std::size_t bytes, const std::string& what, std::vector<Measurement>& out);

  SensorId sensor_;
  Config config_;
  const VelodyneTable& table_;
  std::unique_ptr<VelodyneKernel> kernel_;
  DecodeCounts counts_;

  struct Previous {
    nanoseconds stamp;
    nanoseconds duration;
    HostTime received;
    nanoseconds travelled;  ///< of the counter, since the first packet
    int azimuth;            ///< of the first block, 0.01 deg
    double turn_rate;       ///< 0.01 deg a second
  };
  /// The part of the circle over which the scanner itself sends nothing, 0.01 deg.
  struct SilentPart {
    int begin, width;
  };
  nanoseconds silent_time(const Previous& from, nanoseconds moved) const;

  VelodyneTiming timing_;
  std::vector<Packet> held_;  // with a factory byte of another model, until the timing has spoken
  std::optional<bool> is_other_byte_ours_;
  std::optional<SilentPart> silent_part_;
  std::array<std::byte, 1206> newest_bytes_{};  // of the last data packet, to know it again
  std::optional<Previous> previous_;
  GapTrial gaps_;             // by Previous::travelled, ns
  std::uint64_t broken_ = 0;  // data packets since the last good one: they came, so they are not lost
  std::optional<TimeLabel> last_label_;
};

}  // namespace hueline::drivers
