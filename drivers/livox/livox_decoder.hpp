#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/arrival_watch.hpp"
#include "drivers/livox/livox_kernel.hpp"
#include "drivers/livox/livox_wire.hpp"
#include "drivers/message_counter.hpp"

namespace hueline::drivers {

/// Decodes the packets of Livox scanners of both generations (livox_wire.hpp). Each packet of points gives one
/// LaserBatch, even if no return is left. Packets of the IMU are counted and ignored. It follows the maker's
/// descriptions; no recording of such a scanner was there to check it.
///
/// LaserBatch::time is the first firing of the packet, as the packet says what its time is. No clock gets an offset: a
/// time since power-up, and PTP whose time scale the rig does not state, are readings of the scanner's own counter. The
/// firings of a packet are equally spaced. A packet of the first generation does not say how far: by the stamps of two
/// packets that follow each other, 10 us or 25/6 us.
///
/// Frame: Scanner; the maker's x (forward) is y, and its y (to the left) is -x. The scanners have no rings: channel is
/// 0. azimuth counts from the maker's x to its y. Several returns of a firing are counted by range; equal ones are one.
///
/// Faults:
/// - Malformed: a datagram that is no packet, or a time that cannot be.
/// - WrongDevice: a packet of another scanner behind the same hub; it is not used.
/// - NoTime: the scanner follows no reference though the rig says that it does (not used), or says that what it follows
///   is broken (used).
/// - Lost: by the count of packets, or by the stamps where there is none.
/// - Late: a packet came after newer ones. It is used.
/// - Spurious: the same packet came again.
/// - Silent: nothing came for a while, and what was sent then comes late (ArrivalWatch).
/// - ClockStep: the stamp jumped relative to the arrival, or another clock stamps from now on.
///
/// Thread safety: none; one thread calls all functions.
class LivoxDecoder final : public Decoder {
 public:
  /// What PTP stamps count.
  enum class Scale : std::uint8_t {
    Told,  ///< not known: the packets do not say it
    Utc,   ///< Unix time
    Tai,   ///< seconds since 1970 without leap seconds
  };
  struct Config {
    Scale scale = Scale::Told;
    double min_range_m = 0.05;          ///< nearer returns are dropped, such as those of the housing
    std::optional<double> max_range_m;  ///< farther returns are dropped; without it all are kept

    void visit(Keys& keys);
    KeyError validate() const;
  };

  explicit LivoxDecoder(const Config& config)
      : config_(config), kernel_(config.min_range_m, config.max_range_m.value_or(1e9)) {}

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }

 private:
  /// The packet of points before.
  struct Previous {
    LivoxTimeKind time_kind;
    std::int64_t time_ns;
    std::size_t points;
    std::optional<std::uint16_t> sequence;
    HostTime received;
  };

  void tell(const Packet& packet, FaultKind kind, std::uint64_t count, std::string what,
            std::vector<Measurement>& out) const;
  void refuse(const Packet& packet, FaultKind kind, const std::string& what, std::vector<Measurement>& out);
  std::optional<LaserTime> time_of(const LivoxPacket& data) const;
  bool follow(const Packet& packet, const LivoxPacket& data, std::vector<Measurement>& out);
  void follow_count(const Packet& packet, const LivoxPacket& data, std::int64_t since_ns, std::uint16_t sequence_before,
                    std::vector<Measurement>& out);
  void tell_clock(const Packet& packet, const LivoxPacket& data, const LaserTime& time, std::vector<Measurement>& out);
  double interval_ns(const LivoxPacket& data) const;

  SensorId sensor_ = kSystemSensor;
  Config config_;
  LivoxKernel kernel_;
  DecodeCounts counts_;
  MessageCounter points_;  ///< of the packets of points
  std::optional<std::uint16_t> scanner_;
  std::optional<Previous> previous_;
  ArrivalWatch arrivals_;
  std::optional<double> learnt_interval_ns_;  // of the first generation
  bool is_abnormal_told_ = false;
  std::optional<std::int64_t> told_second_;
  std::optional<SyncState> told_state_;
};

}  // namespace hueline::drivers
