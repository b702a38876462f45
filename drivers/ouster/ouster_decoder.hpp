#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/arrival_watch.hpp"
#include "drivers/ouster/ouster_metadata.hpp"
#include "drivers/ouster/ouster_wire.hpp"
#include "drivers/profile_scanner/counter_watch.hpp"

namespace hueline::drivers {

class OusterKernel;

/// Decodes the packets of an Ouster: its metadata, its time and its datagrams (ouster_wire.hpp), told apart by their
/// first byte. Each data packet gives one LaserBatch, even if no return is left; before the metadata it gives a fault.
/// IMU and zone packets, and data packets without a valid column, are counted and ignored.
///
/// LaserBatch::time is the earliest column of the packet. It is absolute if the rig or the metadata say what the stamps
/// count; otherwise it is a counter of the scanner's own origin. A return has the time of its own column. Two returns
/// of a firing are counted by range; equal ones are one. Once a second of the stamps there is a LaserStatus and, if the
/// time is absolute, a TimeLabel.
///
/// Frame: Scanner, with the origin in the centre of the beams: the maker's lidar frame, turned so that y is the maker's
/// x of the sensor frame (away from the connector) and x is to the right.
///
/// Faults:
/// - Malformed: a wrong size, metadata that cannot be read, or a column with a number or time that cannot be.
/// - WrongDevice: a packet of another scanner than that of the metadata.
/// - NoTime: the scanner has no date though the rig says that it follows one; the packet is not used.
/// - Implausible: data before the metadata (not used); metadata of an earlier initialisation; a scanner that is hot.
/// - Lost, Late, Spurious: by the numbers of frames and columns.
/// - Silent: nothing came for a while, and what was sent then comes late (ArrivalWatch).
/// - ClockStep: the stamp jumped relative to the arrival.
///
/// Thread safety: none; one thread calls all functions.
class OusterDecoder final : public Decoder {
 public:
  /// What the scanner's stamps count.
  enum class Scale : std::uint8_t {
    Told,  ///< what its metadata say, and its own report of its clock
    Utc,   ///< Unix time, and the clock is locked
    Tai,   ///< seconds since 1970 without leap seconds, as PTP counts, and the clock is locked
  };
  struct Config {
    Scale scale = Scale::Told;
    double min_range_m = 0.05;          ///< nearer returns are dropped, such as those of the housing
    std::optional<double> max_range_m;  ///< farther returns are dropped; without it all are kept

    void visit(Keys& keys);
    KeyError validate() const;
  };

  /// `metadata`: if they are known before the first packet.
  explicit OusterDecoder(const Config& config, std::optional<OusterMetadata> metadata = {});
  ~OusterDecoder() override;
  OusterDecoder(const OusterDecoder&) = delete;
  OusterDecoder& operator=(const OusterDecoder&) = delete;

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }

 private:
  /// The scanner's own report, and when it came.
  struct Report {
    OusterClock clock;
    HostTime received;
  };
  struct State {
    SyncState clock;
    std::string words;
  };

  void use(OusterMetadata metadata);
  void decode_text(const Packet& packet, std::vector<Measurement>& out);
  void refuse(const Packet& packet, FaultKind kind, const std::string& what, std::vector<Measurement>& out);
  void ignore(const Packet& packet, const char* name);
  void tell(const Packet& packet, FaultKind kind, std::uint64_t count, std::string what,
            std::vector<Measurement>& out) const;
  bool is_of_this_scanner(const Packet& packet, const OusterHeader& header, std::vector<Measurement>& out);
  bool follow(const Packet& packet, const OusterHeader& header, int column, std::vector<Measurement>& out);
  std::optional<LaserTime> time_of(std::uint64_t stamp_ns) const;
  void check_clock(const Packet& packet, std::uint64_t stamp_ns, std::vector<Measurement>& out);
  State state(HostTime now) const;
  void tell_clock(const Packet& packet, std::uint64_t stamp_ns, const LaserTime& time, std::vector<Measurement>& out);

  SensorId sensor_ = kSystemSensor;
  Config config_;
  std::optional<OusterMetadata> metadata_;
  std::string name_ = "Ouster";
  std::unique_ptr<OusterKernel> kernel_;
  std::vector<int> packets_;  ///< number of each packet of a frame among those that are sent, by its place in the frame
  int packets_per_frame_ = 0;
  DecodeCounts counts_;

  CounterWatch counter_;
  std::optional<std::int64_t> frame_;  ///< number of the newest frame, without the wrap of the header's
  std::optional<std::uint32_t> init_id_;
  bool is_hot_ = false;
  struct Previous {
    std::uint64_t stamp_ns;
    HostTime received;
  };
  std::optional<Previous> previous_;
  ArrivalWatch arrivals_;
  std::optional<Report> report_;
  std::optional<std::uint64_t> told_second_;
  std::optional<SyncState> told_state_;
};

}  // namespace hueline::drivers
