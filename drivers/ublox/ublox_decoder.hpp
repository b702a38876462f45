#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/keys.hpp"
#include "drivers/nmea/nmea_epoch.hpp"
#include "drivers/stream/stream_decoder.hpp"
#include "drivers/ublox/ublox_high_rate.hpp"

namespace hueline::drivers {

/// Decodes the stream of a u-blox receiver of the generations 5 to 10: UBX, mixed with NMEA sentences, RTCM 3 and text.
///
///   what comes                                       measurement
///   NAV-PVT, NAV-PVAT, NAV-SOL, NAV-POSLLH with      GnssFix, one for each epoch, from the best of them;
///     NAV-STATUS; NAV-HPPOSLLH, NAV-COV              its position in full and its sigmas
///   HNR-PVT and HNR-ATT, else NAV-PVAT, or           InsSolution; good while the receiver fuses its inertial sensors
///     NAV-PVT and NAV-ATT
///   the first epoch of a second                      TimeLabel
///   TIM-TM2                                          EventMark
///   ACK-NAK                                          Fault Refused
///   NMEA, if no UBX navigation message comes         as NmeaEpoch says
///   bytes that are skipped                           Fault Malformed, with their number
///   navigation messages that never came              Fault Lost, judged by their period
///   times of the receiver that contradict each       Fault LabelConflict; the measurement is not trusted
///     other, such as UTC taken for GPS time
///   no time yet, or no time any more                 Fault NoTime; what would need it is not emitted
///
/// The messages of an epoch have the same time of week. The epoch is complete with the message that was the last one of
/// the epoch before, or with a message of a later epoch. Raw observations (RXM-RAWX, RXM-SFRBX) and the values of
/// single sensors (ESF-MEAS, ESF-RAW) are recorded and counted. `received` is the arrival of the epoch's position.
class UbloxDecoder final : public StreamDecoder {
 public:
  /// Which edge at the input EXTINT is the event.
  enum class Edge : std::uint8_t { Rising, Falling };
  struct Config {
    Edge mark_edge = Edge::Rising;
    void visit(Keys& keys);
    KeyError validate() const { return check_keys(*this); }
  };

  explicit UbloxDecoder(const Config& config);

 private:
  using Payload = std::span<const std::byte>;
  /// What the messages of one epoch said.
  struct Epoch {
    Epoch() {}  // without it clang 14 cannot make one inside an optional of the enclosing class
    std::uint32_t itow_ms = 0;
    unsigned seen = 0;             ///< which messages came, as bits
    bool is_again = false;         ///< the epoch was taken for complete before
    std::optional<GpsTime> time;   ///< from a message with a complete time
    std::optional<int> week;       ///< from a message with a week
    std::int32_t nanoseconds = 0;  ///< the part of the time of week below a millisecond
    HostTime received{};
    int rank = 0;  ///< of the message that the position is from; 0: there is none
    GnssFix fix{};
    std::optional<Geodetic> precise;  ///< of NAV-HPPOSLLH
    std::optional<std::array<double, 3>> precise_sigma;
    std::optional<std::array<double, 3>> position_sigma, velocity_sigma;  ///< of NAV-COV
    bool is_ok = false;                                                   ///< gnssFixOK
    std::uint8_t fix_type = 0;
    bool has_velocity = false;
    Eigen::Vector3d velocity_enu = Eigen::Vector3d::Zero();
    double velocity_accuracy = 0;
    std::optional<Attitude> attitude;
    std::array<double, 3> attitude_sigma{};
  };

  bool take(const Message& message) override;
  void finish() override;
  void forget() override;

  bool take_ubx(const Message& message);
  bool take_navigation(std::uint8_t id, Payload payload, const Message& message);
  bool take_high_rate(std::uint8_t id, Payload payload, const Message& message);
  bool take_mark(Payload payload, HostTime received);
  void open_epoch(std::uint32_t itow_ms, unsigned part);
  void close_epoch();
  bool outranks(int rank, HostTime received);
  void use_calendar(Payload payload, std::size_t at, std::uint8_t valid, std::int32_t nanosecond, double accuracy_s,
                    bool is_ok, HostTime received);
  std::optional<GpsTime> time_of(const Epoch& epoch) const;
  void label(std::optional<GpsTime> time, bool is_valid, HostTime received);
  static GpsTime milliseconds_of(GpsTime time) {
    return GpsTime(std::chrono::round<std::chrono::milliseconds>(time.time_since_epoch()));
  }

  const Config config_;
  NmeaEpoch nmea_;
  UbloxHighRate high_rate_;
  bool has_high_rate_ = false;
  std::optional<Epoch> epoch_;
  unsigned usual_ = 0;                        // the messages of the epoch before
  unsigned late_ = 0;                         // messages of this epoch that came before it was taken for complete
  std::optional<std::uint32_t> closed_itow_;  // the epoch before
  unsigned closed_seen_ = 0;
  std::optional<GpsTime> latest_;                   // time of the latest epoch
  std::optional<GpsTime> labelled_;                 // the latest second that a label named
  std::optional<std::chrono::seconds> utc_offset_;  // that the receiver reports
  std::optional<std::uint8_t> fusion_mode_;         // of ESF-STATUS
  bool has_navigation_ = false;                     // UBX navigation messages come, so NMEA says nothing new
  bool has_no_time_ = false;
  bool contradicts_ = false;  // the time of the week and UTC differ
};

}  // namespace hueline::drivers
