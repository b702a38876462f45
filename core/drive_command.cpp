#include "core/drive_command.hpp"

#include <fmt/format.h>

#include <string_view>

#include "core/printable.hpp"

namespace hueline {

const char* name(DriveCommand::Kind kind) {
  switch (kind) {
    case DriveCommand::Kind::Mark:
      return "mark";
    case DriveCommand::Kind::Stop:
      return "stop";
  }
  return "?";
}

Status check_note(const std::string& note) {
  if (note.size() > DriveCommand::kMostNoteBytes)
    return Error{ErrorCode::Invalid, fmt::format("the note has {} bytes; allowed are at most {}: shorten it",
                                                 note.size(), DriveCommand::kMostNoteBytes)};
  if (printable(note) != note)
    return Error{ErrorCode::Invalid, "the note is not plain UTF-8 text in one line: leave out control characters"};
  return {};
}

std::vector<std::byte> encode_command(const DriveCommand& command) {
  const std::string text = fmt::format("{}\n{}", name(command.kind), command.note);
  const auto* const begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

Result<DriveCommand> decode_command(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos)
    return Error{ErrorCode::Malformed, "a command of the operator has no line feed after its word"};
  const std::string_view word = text.substr(0, end);
  for (const auto kind : {DriveCommand::Kind::Mark, DriveCommand::Kind::Stop}) {
    if (word != name(kind)) continue;
    DriveCommand command{kind, std::string(text.substr(end + 1))};
    if (Status checked = check_note(command.note); !checked.ok())
      return Error{ErrorCode::Malformed, checked.error().message};
    return command;
  }
  return Error{ErrorCode::Malformed, fmt::format("'{}' is no command of the operator", printable(word.substr(0, 40)))};
}

}  // namespace hueline
