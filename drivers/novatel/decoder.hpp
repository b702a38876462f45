#pragma once

#include <array>
#include <string>
#include <unordered_map>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/novatel/framer.hpp"
#include "drivers/novatel/imu.hpp"
#include "drivers/novatel/log_losses.hpp"
#include "drivers/novatel/message_table.hpp"

namespace hueline::drivers {

/// NovAtel OEM7 (and OEM6) receivers with SPAN: binary messages -> measurements, in stream order.
///
///   INSPVA(S), INSPVAX -> InsSolution           BESTPOS -> GnssFix (primary antenna)
///   INSSTDEV(S)        -> InsUncertainty        TIME -> TimeLabel
///   MARK1..4TIME, MARK1..4PVA -> EventMark, one an event though both report it
///   RAWIMU(S)(X), CORRIMUDATA(S), CORRIMUS, IMURATECORRIMUS -> ImuSample
///   any message whose header names a moment just past, good time status -> also TimedArrival
///   answers `<ERROR...` -> Fault Refused; bytes passed over -> Fault Malformed with their number
///   logs that never came, by their period (LogLosses) -> Fault Lost with their number
///
/// Other messages are counted by name and ignored. A short header has no time status: it inherits that of the latest
/// long one. `received` is the arrival of the packet that brought a message's last byte, also when broken bytes before
/// it delayed its recognition. Messages and text in DecodeCounts::messages are counted under the maker's name; "text"
/// counts lines, "#123" a message of unknown id, a suffix "_1" the secondary antenna's, "response" an answer to a
/// binary command.
class NovatelDecoder final : public Decoder, private NovatelFramer::Sink {
 public:
  struct Config {
    NovatelFramer::Config framer;
    NovatelImu::Config imu;
    /// Takes INS_ALIGNMENT_COMPLETE for good as well: the filter navigates, but has not moved enough to keep its
    /// specification. For trying a rig on a standing vehicle; the receiver's own sigmas say how good it is.
    bool accepts_alignment_complete = false;
    void visit(Keys& keys);
    KeyError validate() const;
  };

  explicit NovatelDecoder(const Config& config);

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void flush(std::vector<Measurement>& out) override;
  /// What is held counts as malformed. Call flush() first to get what stands whole behind a broken header.
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }
  /// Given to decode(), but not in the counts yet: the beginning of a message, or skipped bytes to be reported.
  std::uint64_t held_bytes() const { return framer_.held_bytes(); }

 private:
  void on_message(const NovatelMessage& message) override;
  void on_text(std::string_view text, HostTime received) override;
  void on_skipped(std::uint64_t bytes, std::uint64_t messages, std::uint16_t first_id, HostTime received) override;

  bool use(const NovatelMessage& message, const NovatelMessageInfo& info);
  bool use_mark(std::optional<EventMark> mark, HostTime received);
  void use_time(const NovatelMessage& message, bool& used);
  void note_arrival(const NovatelMessage& message);
  void watch_losses(const NovatelMessage& message, const NovatelMessageInfo* info);
  void count(const NovatelHeader& header, const NovatelMessageInfo* info);
  void fault(FaultKind kind, HostTime time, std::uint64_t count, std::string detail);
  bool time_is_fine() const { return time_status_ && is_fine(*time_status_); }
  template <class T>
  bool emit(std::optional<T> measurement, HostTime received);

  NovatelFramer framer_;
  NovatelImu imu_;
  LogLosses losses_;
  const bool accepts_alignment_complete_;
  DecodeCounts counts_;
  std::unordered_map<std::uint32_t, std::uint64_t*> counters_;  // into counts_.messages
  std::optional<std::uint8_t> time_status_;                     // of the latest timely long header
  std::optional<GpsTime> measured_;                             // the running message's own time
  bool ins_is_good_ = false;
  std::array<std::array<std::optional<GpsTime>, 8>, 5> seen_marks_{};  // the latest of each input: ring
  std::array<std::size_t, 5> next_seen_{};
  HostTime newest_{};  // arrival of the latest message
  SensorId sensor_ = kSystemSensor;
  std::vector<Measurement>* out_ = nullptr;  // of the running call
};

}  // namespace hueline::drivers
