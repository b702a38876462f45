#pragma once

#include <cstddef>
#include <cstdint>

namespace hueline::drivers {

/// What we do with a message.
enum class NovatelUse : std::uint8_t {
  Ignored, InsPva, InsPvaX, InsStdev, BestPos, Time, MarkTime, MarkPva, RawImu, RawImuX, CorrImuData, CorrImuS,
  ImuRateCorrImuS, InsConfig,
};

struct NovatelMessageInfo {
  std::uint16_t id;
  const char* name;
  NovatelUse use;
  std::uint8_t body_bytes;   ///< as in the OEM7 manual; newer firmware may append fields. 0: varies
  bool is_timely;            ///< its header names a moment just past (synchronous logs, marks); polled and ONCHANGED logs do not
  std::uint8_t input = 0;    ///< event input 1..4 of marks
};

/// Null for an id we have no name for.
const NovatelMessageInfo* find_novatel_message(std::uint16_t id);

/// Whether a message of this id can have a body of this length. A corrupted length is told from the header alone, without
/// waiting for bytes that never come. Firmware may append fields: up to 64 bytes more pass.
bool is_plausible_length(std::uint16_t id, std::size_t body_bytes);

}  // namespace hueline::drivers
