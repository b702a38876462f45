#include "drivers/can/dbc.hpp"

#include <fmt/format.h>

#include <charconv>
#include <utility>

namespace hueline::drivers {
namespace {

/// Reads one line from left to right.
struct Scanner {
  std::string_view rest;

  void skip_blanks() {
    while (!rest.empty() && (rest.front() == ' ' || rest.front() == '\t')) rest.remove_prefix(1);
  }
  bool take(std::string_view word) {
    skip_blanks();
    if (!rest.starts_with(word)) return false;
    rest.remove_prefix(word.size());
    return true;
  }
  /// Returns the text up to a blank or one of `ends`.
  std::string_view word(std::string_view ends = "") {
    skip_blanks();
    std::size_t n = 0;
    while (n < rest.size() && rest[n] != ' ' && rest[n] != '\t' && ends.find(rest[n]) == std::string_view::npos) ++n;
    const std::string_view out = rest.substr(0, n);
    rest.remove_prefix(n);
    return out;
  }
  template <class T>
  bool number(T& value) {
    skip_blanks();
    if (rest.starts_with('+')) rest.remove_prefix(1);
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    if (error != std::errc()) return false;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return true;
  }
};

Error bad(std::string_view part) {
  return {
      ErrorCode::Malformed,
      fmt::format("{} is missing or wrong; a signal is like: SG_ NAME : 0|16@1+ (0.01,0) [0|655.35] \"unit\" RECEIVER",
                  part)};
}

}  // namespace

Result<DbcSignal> parse_dbc_signal(std::string_view line) {
  DbcSignal out;
  Scanner in{line};
  if (!in.take("SG_")) return bad("SG_");
  out.name = in.word(":");
  if (out.name.empty()) return bad("the name");
  // "M" alone marks the signal that selects the others. It is in every frame itself.
  const std::string_view selector = in.word(":");
  out.is_multiplexed = selector.starts_with('m');
  if (!in.take(":")) return bad("':'");
  int order = 0;
  if (!in.number(out.signal.start_bit) || !in.take("|") || !in.number(out.signal.bits)) return bad("start|bits");
  if (!in.take("@") || in.rest.empty()) return bad("@order");
  order = in.rest.front() - '0';
  in.rest.remove_prefix(1);
  if (order != 0 && order != 1) return bad("@order (0: Motorola, 1: Intel)");
  out.signal.order = order == 1 ? BitOrder::Little : BitOrder::Big;
  if (in.take("-"))
    out.signal.is_signed = true;
  else if (!in.take("+"))
    return bad("the sign (+ or -)");
  if (!in.take("(") || !in.number(out.signal.scale) || !in.take(",") || !in.number(out.signal.offset) || !in.take(")"))
    return bad("(scale,offset)");
  if (!in.take("[") || !in.number(out.signal.min) || !in.take("|") || !in.number(out.signal.max) || !in.take("]"))
    return bad("[min|max]");
  // Files of makers contain empty ranges, which mean that there is no range.
  if (out.signal.min > out.signal.max) out.signal.min = out.signal.max = 0;
  if (in.take("\"")) {
    const std::size_t end = in.rest.find('"');
    if (end == std::string_view::npos) return bad("the end of \"unit\"");
    out.unit = in.rest.substr(0, end);
  }
  if (const std::string wrong = out.signal.validate(); !wrong.empty())
    return Error{ErrorCode::Malformed, out.name + ": " + wrong};
  return out;
}

Result<std::vector<DbcMessage>> parse_dbc(std::string_view text) {
  std::vector<DbcMessage> out;
  std::size_t number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    Scanner in{line};
    if (in.take("BO_ ")) {
      DbcMessage message;
      std::uint32_t id = 0;
      if (!in.number(id)) return Error{ErrorCode::Malformed, fmt::format("line {}: BO_ without an id", number)};
      message.is_extended = (id & 0x80000000) != 0;
      message.id = id & 0x1FFFFFFF;
      message.name = in.word(":");
      if (!in.take(":") || !in.number(message.length))
        return Error{ErrorCode::Malformed, fmt::format("line {}: BO_ {} without a length", number, id)};
      out.push_back(std::move(message));
    } else if (in.take("SG_ ")) {
      Result<DbcSignal> signal = parse_dbc_signal(line);
      if (!signal.ok()) return Error{ErrorCode::Malformed, fmt::format("line {}: {}", number, signal.error().message)};
      if (out.empty()) return Error{ErrorCode::Malformed, fmt::format("line {}: SG_ before any BO_", number)};
      out.back().signals.push_back(std::move(*signal));
    }
  }
  return out;
}

}  // namespace hueline::drivers
