#pragma once

#include <cstddef>
#include <cstdint>

namespace hueline::drivers {

/// What the decoder does with a message.
enum class NovatelUse : std::uint8_t {
  Ignored,
  InsPva,
  InsPvaX,
  InsStdev,
  BestPos,
  Time,
  MarkTime,
  MarkPva,
  RawImu,
  RawImuX,
  CorrImuData,
  CorrImuS,
  ImuRateCorrImuS,
  InsConfig,
};

/// What the time in a message's header is.
enum class NovatelStamp : std::uint8_t {
  Any,     ///< unknown; logs that are polled or ONCHANGED may have any time
  Moment,  ///< a moment just past: event marks, and logs that come when something is new
  /// A moment just past that steps by a period: logs that are asked for ONTIME, or made with each sample of the IMU.
  Regular,
};

/// What is known about the messages with one id.
struct NovatelMessageInfo {
  std::uint16_t id;
  const char* name;
  NovatelUse use;
  std::uint8_t body_bytes;  ///< length of the body in the OEM7 manual; newer firmware may append fields. 0: it varies
  NovatelStamp stamp;
  std::uint8_t input = 0;  ///< event input of a mark, 1 to 4

  bool is_timely() const { return stamp != NovatelStamp::Any; }
};

/// Returns the entry of a message id, or null if the id is not in the table.
const NovatelMessageInfo* find_novatel_message(std::uint16_t id);

/// Returns whether a message with this id can have a body of this length. So a corrupted length is recognised from the
/// header alone, without waiting for bytes that never come. Up to 64 bytes more than in the manual are accepted,
/// because firmware may append fields.
bool is_plausible_length(std::uint16_t id, std::size_t body_bytes);

}  // namespace hueline::drivers
