#pragma once

#include <array>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/novatel/framer.hpp"
#include "drivers/novatel/imu.hpp"
#include "drivers/novatel/log_losses.hpp"
#include "drivers/novatel/message_table.hpp"

namespace hueline::drivers {

/// Decodes the messages of NovAtel OEM7 (and OEM6) receivers with SPAN, binary or ASCII, into measurements, in the
/// order of the stream.
///
///   what comes                                               measurement
///   INSPVA(S), INSPVAX                                       InsSolution
///   INSSTDEV(S)                                              InsUncertainty
///   BESTPOS                                                  GnssFix (primary antenna)
///   TIME                                                     TimeLabel
///   MARK1..4TIME, MARK1..4PVA                                EventMark, one for each event, even if both report it
///   RAWIMU(S)(X), CORRIMUDATA(S), CORRIMUS, IMURATECORRIMUS  ImuSample
///   a message whose header time is a moment just past,       TimedArrival, in addition
///     with good time status
///   an answer `<ERROR...`                                    Fault Refused
///   bytes that are skipped                                   Fault Malformed, with their number
///   logs that never came, judged by their period (LogLosses) Fault Lost, with their number
///
/// Other messages are counted by name and ignored. A short header has no time status; it takes that of the latest long
/// header. `received` is the arrival of the packet with a message's last byte, even if broken bytes before the message
/// delayed its recognition.
///
/// DecodeCounts::messages counts messages under NovAtel's names, with the suffix "_1" for the secondary antenna. "text"
/// counts lines, "#123" a message with an unknown id, "response" the answer to a binary command.
class NovatelDecoder final : public Decoder, private NovatelFramer::Sink {
 public:
  struct Config {
    NovatelFramer::Config framer;
    NovatelImu::Config imu;
    /// Also accept INS_ALIGNMENT_COMPLETE as good: the filter navigates, but the vehicle has not moved enough for the
    /// filter to keep its specification. Use it to try a rig on a standing vehicle; the receiver's own sigmas say how
    /// good the solution is.
    bool accepts_alignment_complete = false;
    void visit(Keys& keys);
    KeyError validate() const;
  };

  explicit NovatelDecoder(const Config& config);

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void flush(std::vector<Measurement>& out) override;
  /// Counts the bytes that are held as malformed. Call flush() first to get the whole messages among them.
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }
  /// Returns the number of bytes that decode() was given but that are not in the counts yet: the beginning of a
  /// message, or skipped bytes that are not reported yet.
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
  // Pointers into counts_.messages, by antenna and message id.
  std::unordered_map<std::uint32_t, std::uint64_t*> counters_;
  std::optional<std::uint8_t> time_status_;  // of the latest long header with a timely time
  std::optional<GpsTime> measured_;          // the time of the current message's own measurement
  bool ins_is_good_ = false;
  std::array<std::array<std::optional<GpsTime>, 8>, 5> seen_marks_{};  // the latest marks of each input, as rings
  std::array<std::size_t, 5> next_seen_{};
  HostTime newest_{};  // arrival of the latest message
  SensorId sensor_ = kSystemSensor;
  std::vector<Measurement>* out_ = nullptr;  // where the current call puts measurements
};

}  // namespace hueline::drivers
