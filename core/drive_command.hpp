#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace hueline {

/// What an operator asks of a drive. It enters the journal as a packet of the kind Command, so a replay shows it.
struct DriveCommand {
  enum class Kind : std::uint8_t {
    Mark,  ///< remember this moment and place, with a note
    Stop,  ///< end the drive with everything written
  };
  Kind kind = Kind::Mark;
  std::string note;  ///< UTF-8 without control characters, at most kMostNoteBytes

  static constexpr std::size_t kMostNoteBytes = 500;
};
/// Returns the word of it: "mark", "stop".
const char* name(DriveCommand::Kind kind);

/// Checks a note. Error: Invalid if it is too long, is not UTF-8, or contains what controls a terminal.
Status check_note(const std::string& note);

/// Returns the bytes of a command in the journal: its word, a line feed, and its note.
std::vector<std::byte> encode_command(const DriveCommand& command);
/// Reads them. Error: Malformed.
Result<DriveCommand> decode_command(std::span<const std::byte> bytes);

}  // namespace hueline
