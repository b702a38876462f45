#pragma once

#include <cstddef>
#include <cstdint>

namespace hueline::drivers {

/// What we do with a message.
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

/// What the time in a message's header names.
enum class NovatelStamp : std::uint8_t {
  Any,      ///< whatever polled and ONCHANGED logs tell of
  Moment,   ///< a moment just past: marks, logs given when something is new
  Regular,  ///< that too, of a log asked for ONTIME or made with each sample of the inertial unit: it steps by its
            ///< period
};

struct NovatelMessageInfo {
  std::uint16_t id;
  const char* name;
  NovatelUse use;
  std::uint8_t body_bytes;  ///< as in the OEM7 manual; newer firmware may append fields. 0: varies
  NovatelStamp stamp;
  std::uint8_t input = 0;  ///< event input 1..4 of marks

  bool is_timely() const { return stamp != NovatelStamp::Any; }
};

/// Null for an id we have no name for.
const NovatelMessageInfo* find_novatel_message(std::uint16_t id);

/// Whether a message of this id can have a body of this length. A corrupted length is told from the header alone,
/// without waiting for bytes that never come. Firmware may append fields: up to 64 bytes more pass.
bool is_plausible_length(std::uint16_t id, std::size_t body_bytes);

}  // namespace hueline::drivers
