#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/stream/message_form.hpp"

namespace hueline::drivers {

/// NMEA 0183 sentences of any talker: '$' (or '!'), text, '*', the exclusive or of that text as two hexadecimal digits,
/// and the end of the line. A line feed alone ends a line as well. A sentence without check sum is Broken: nothing says
/// that it came whole. Sentences may be up to 1024 bytes long: receivers exceed the 82 bytes of the standard.
class NmeaForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool is_boundary) override;

 private:
  std::uint64_t seen_at_ = 0;
  std::size_t seen_bytes_ = 0;
};

/// Splits a sentence that NmeaForm found whole.
class NmeaSentence {
 public:
  explicit NmeaSentence(std::span<const std::byte> bytes);

  /// Returns "GN" of GNGGA. It is empty for a maker's own sentence.
  std::string_view talker() const;
  /// Returns "GGA" of GNGGA; the whole word of a maker's own sentence: "PASHR".
  std::string_view type() const;
  /// Returns the number of fields, without the address.
  std::size_t size() const { return count_ == 0 ? 0 : count_ - 1; }
  /// Returns a field by its number in the maker's documents: 1 is the first one behind the address. Empty if the
  /// sentence has no such field.
  std::string_view field(std::size_t number) const;
  /// Returns a field as a number; nothing if it is empty or no number.
  std::optional<double> number(std::size_t number) const;
  std::optional<int> whole(std::size_t number) const;

 private:
  static constexpr std::size_t kMost = 64;  // fields beyond are not looked at
  std::array<std::string_view, kMost> fields_{};
  std::size_t count_ = 0;
};

}  // namespace hueline::drivers
