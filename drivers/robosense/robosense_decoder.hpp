#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/arrival_watch.hpp"
#include "drivers/message_counter.hpp"
#include "drivers/robosense/robosense_kernel.hpp"
#include "drivers/robosense/robosense_solid.hpp"
#include "drivers/robosense/robosense_wire.hpp"

namespace hueline::drivers {

/// Decodes the packets of RoboSense scanners: of those that rotate (RobosenseModel), and of the M1 and the E1, which do
/// not and whose packets say all (robosense_solid.hpp). Of a scanner that rotates the directions of the beams are those
/// of the scanner's own description, which it sends about once a second; packets of points before the first one are not
/// used. Each packet of points gives one LaserBatch, even if no return is left. No recording of such a scanner was
/// there to check the decoder.
///
/// LaserBatch::time is the first firing of the packet. It is a date only while the scanner says that it follows a
/// receiver, or PTP whose time scale the rig states; otherwise it is a reading of the scanner's own counter. A return
/// has the time of its own firing, and the azimuth of the block, of the time in it, and of the beam. Two returns of a
/// firing are counted by range; equal ones are one. Frame: Scanner (z up, y forward at azimuth 0, x right; azimuth
/// clockwise from above), with the origin on the axis where the maker has it.
///
/// Faults:
/// - Malformed: a wrong size or signature, a block without its flag, a time that cannot be.
/// - Implausible: points before the first description (not used); a description without angles.
/// - WrongDevice: points of a model that is not known, or of another model than before.
/// - NoTime: the scanner follows no reference though the rig says that it does; the packet is not used.
/// - Lost, Late, Spurious: by the stamps, as not every model counts its packets; of M1 and E1 Lost by their count.
/// - Silent: nothing came for a while, and what was sent then comes late (ArrivalWatch).
/// - ClockStep: the stamp jumped relative to the arrival, or the scanner follows another clock from now on.
///
/// Thread safety: none; one thread calls all functions.
class RobosenseDecoder final : public Decoder {
 public:
  /// What the scanner's clock follows.
  enum class Reference : std::uint8_t {
    Told,    ///< what its description says; the time scale of PTP it does not say
    PtpUtc,  ///< PTP with the UTC time scale
    PtpTai,  ///< PTP with TAI
  };
  struct Config {
    Reference reference = Reference::Told;
    std::optional<double> range_unit_m;  ///< of the ranges in the packets; without it the model's
    double min_range_m = 0.1;            ///< nearer returns are dropped, such as those of the housing
    std::optional<double> max_range_m;   ///< farther returns are dropped; without it all are kept
    /// The directions of the beams, in the order of the channels, in place of the description's. Both are empty, or
    /// have as many as the scanner has beams.
    std::vector<double> elevations_deg, azimuths_deg;

    void visit(Keys& keys);
    KeyError validate() const;
  };

  /// `description`: a packet with the scanner's description, if one is known before the first packet.
  explicit RobosenseDecoder(const Config& config, std::vector<std::byte> description = {})
      : config_(config), description_bytes_(std::move(description)) {}

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }

 private:
  struct Previous {
    UnixTime time;
    HostTime received;
  };

  void tell(const Packet& packet, FaultKind kind, std::uint64_t count, std::string what,
            std::vector<Measurement>& out) const;
  void refuse(const Packet& packet, FaultKind kind, const std::string& what, std::vector<Measurement>& out);
  void decode_solid(const Packet& packet, const RobosenseSolidPacket& data, std::vector<Measurement>& out);
  void decode_description(const Packet& packet, std::vector<Measurement>& out);
  bool use_description(RobosenseModel model);
  bool use_given_angles(RobosenseModel& model);
  bool is_known(const Packet& packet, std::vector<Measurement>& out);
  std::optional<LaserTime> time_of(UnixTime stamp) const;
  bool follow(const Packet& packet, UnixTime stamp, std::vector<Measurement>& out);
  void tell_gap(const Packet& packet, nanoseconds since, std::vector<Measurement>& out);
  void tell_clock(const Packet& packet, UnixTime stamp, const LaserTime& time, std::vector<Measurement>& out);
  std::size_t decode_points(std::span<const std::byte> bytes, std::vector<LaserReturn>& out);
  std::array<RobosenseBlock, kRobosenseBlocks> blocks_of(std::span<const std::byte> bytes) const;
  bool is_dual(std::span<const std::byte> bytes) const;
  double packet_us(std::span<const std::byte> bytes) const;

  SensorId sensor_ = kSystemSensor;
  Config config_;
  std::vector<std::byte> description_bytes_;  ///< newest description; its meaning depends on the model
  std::optional<RobosenseModel> heard_;       ///< as the packets of points say it
  const RobosenseTable* table_ = nullptr;
  const char* solid_ = nullptr;              ///< name of a scanner that does not rotate
  std::optional<std::uint16_t> sequence_{};  ///< its newest
  RobosenseDescription description_;
  std::optional<RobosenseKernel> kernel_;  ///< of the table and the description
  DecodeCounts counts_;
  MessageCounter points_;  ///< of the packets of points
  bool is_waiting_told_ = false;
  std::optional<Previous> previous_;
  ArrivalWatch arrivals_;
  std::optional<std::int64_t> told_second_;
  std::optional<SyncState> told_state_;
};

}  // namespace hueline::drivers
