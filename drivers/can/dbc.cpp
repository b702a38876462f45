#include "drivers/can/dbc.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <type_traits>
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
    const std::string_view taken = rest.substr(0, static_cast<std::size_t>(end - rest.data()));
    if (error == std::errc::result_out_of_range && std::is_floating_point_v<T>) {
      // Editors write the limits of a signal of many bits as a number beyond those of a double, such as 4.4e481.
      const bool is_tiny = taken.find("e-") != std::string_view::npos || taken.find("E-") != std::string_view::npos;
      value = is_tiny ? T{} : taken.starts_with('-') ? std::numeric_limits<T>::lowest() : std::numeric_limits<T>::max();
    } else if (error != std::errc()) {
      return false;
    }
    rest.remove_prefix(taken.size());
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
  // "M" alone marks the signal that selects the others; "m3" is selected by 3; "m3M" is and does both.
  std::string_view selector = in.word(":");
  out.is_multiplexed = selector.starts_with('m');
  out.is_selector = selector.ends_with('M');
  if (out.is_multiplexed) {
    std::uint64_t value = 0;
    const char* end = selector.data() + selector.size() - (out.is_selector ? 1 : 0);
    if (const auto [at, error] = std::from_chars(selector.data() + 1, end, value); error != std::errc() || at != end)
      return bad("the number behind m");
    out.selected_by.emplace_back(value, value);
  }
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
  // Makers' files hold values beyond what a rig may give, such as a largest value of 1.8e19.
  const CanSignal& s = out.signal;
  if (s.bits < 1 || s.bits > 64 || s.start_bit < 0 || s.start_bit > 511 || s.needed_bytes() > 64)
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: {} bits from bit {} on do not fit into a frame; allowed: 1 to 64 "
                             "bits in 64 bytes",
                             out.name, s.bits, s.start_bit)};
  if (s.scale == 0) return Error{ErrorCode::Malformed, out.name + ": scale is 0; allowed: a number other than 0"};
  return out;
}

namespace {

/// Cuts a text into lines. A line whose quotation marks are open goes on in the next one, unless it is one of a message
/// or a signal: comments (CM_) may hold anything, also what looks like a message.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}
  /// Sets `line` and its number. Returns false at the end.
  bool next(std::string_view& line, std::size_t& number) {
    if (rest_.empty()) return false;
    number = ++number_;
    std::size_t end = 0;
    bool is_open = false;
    Scanner begin{rest_.substr(0, 256)};
    const bool is_one_line = begin.take("SG_ ") || begin.take("BO_ ");
    for (; end < rest_.size() && (is_open || rest_[end] != '\n'); ++end) {
      if (!is_one_line && rest_[end] == '"' && (end == 0 || rest_[end - 1] != '\\')) is_open = !is_open;
      if (rest_[end] == '\n') ++number_;
    }
    if (is_open) {  // an open quotation mark without its end: the line alone, not the rest of the file
      number_ = number;
      end = std::min(rest_.find('\n'), rest_.size());
    }
    line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    return true;
  }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

/// The highest bit marks ids of 29 bits. Some files leave it out where the id has more than 11 bits anyway.
bool has_29_bits(std::uint32_t id) { return (id & 0x80000000) != 0 || (id & 0x1FFFFFFF) > 0x7FF; }

DbcSignal* find_signal(Dbc& dbc, std::uint32_t id, std::string_view name) {
  for (DbcMessage& message : dbc.messages) {
    if (message.id != (id & 0x1FFFFFFF) || message.is_extended != has_29_bits(id)) continue;
    for (DbcSignal& signal : message.signals)
      if (signal.name == name) return &signal;
  }
  return nullptr;
}

/// Reads `ID NAME 0 "off" 1 "on" ;` behind VAL_. A table without an id belongs to no message.
void take_words(Scanner in, Dbc& dbc) {
  std::uint32_t id = 0;
  if (!in.number(id)) return;
  DbcSignal* signal = find_signal(dbc, id, in.word());
  if (!signal) return;
  for (std::int64_t value = 0; in.number(value);) {
    if (!in.take("\"")) return;
    std::size_t end = 0;
    while (end < in.rest.size() && (in.rest[end] != '"' || (end > 0 && in.rest[end - 1] == '\\'))) ++end;
    signal->words[value] = in.rest.substr(0, end);
    in.rest.remove_prefix(std::min(end + 1, in.rest.size()));
  }
}

/// Reads `ID NAME SELECTOR 0-0, 3-5 ;` behind SG_MUL_VAL_.
void take_selection(Scanner in, Dbc& dbc) {
  std::uint32_t id = 0;
  if (!in.number(id)) return;
  DbcSignal* signal = find_signal(dbc, id, in.word());
  if (!signal) return;
  signal->selector = in.word();
  signal->is_multiplexed = true;
  signal->selected_by.clear();
  std::uint64_t from = 0, to = 0;
  while (in.number(from) && in.take("-") && in.number(to)) {
    signal->selected_by.emplace_back(from, to);
    if (!in.take(",")) break;
  }
}

/// Reads `ID NAME : 1 ;` behind SIG_VALTYPE_: 1 float, 2 double.
void take_number_type(Scanner in, std::size_t line, Dbc& dbc) {
  std::uint32_t id = 0;
  int type = 0;
  if (!in.number(id)) return;
  DbcSignal* signal = find_signal(dbc, id, in.word(":"));
  if (!signal || !in.take(":") || !in.number(type)) return;
  if ((type == 1 && signal->signal.bits != 32) || (type == 2 && signal->signal.bits != 64))
    dbc.troubles.push_back(
        fmt::format("line {}: {} is no floating-point number of {} bits", line, signal->name, signal->signal.bits));
  else
    signal->signal.number = type == 1 ? CanNumber::Float : type == 2 ? CanNumber::Double : CanNumber::Integer;
}

/// Gives multiplexed signals the selector of their message, where no SG_MUL_VAL_ named another one.
void name_selectors(Dbc& dbc) {
  for (DbcMessage& message : dbc.messages) {
    const auto selects_all = [](const DbcSignal& signal) { return signal.is_selector && !signal.is_multiplexed; };
    const auto selector = std::ranges::find_if(message.signals, selects_all);
    for (DbcSignal& signal : message.signals)
      if (signal.is_multiplexed && signal.selector.empty() && selector != message.signals.end())
        signal.selector = selector->name;
  }
}

/// Selectors may be selected themselves. This limits how often, and so ends circles.
constexpr std::size_t kSelectorsMost = 8;

bool has(const std::vector<std::pair<std::uint64_t, std::uint64_t>>& ranges, std::int64_t value) {
  return std::ranges::any_of(ranges, [&](const auto& range) {
    return value >= 0 && static_cast<std::uint64_t>(value) >= range.first &&
           static_cast<std::uint64_t>(value) <= range.second;
  });
}

/// Returns the signal that selects `signal`, or null.
const DbcSignal* selector_of(const DbcMessage& message, const DbcSignal& signal) {
  const auto found = std::ranges::find(message.signals, signal.selector, &DbcSignal::name);
  return found == message.signals.end() ? nullptr : &*found;
}

/// Returns whether the frame has the signal.
bool is_there(const DbcMessage& message, const DbcSignal& signal, std::span<const std::uint8_t> data) {
  const DbcSignal* one = &signal;
  for (std::size_t depth = 0; depth <= kSelectorsMost; ++depth) {
    if (one->signal.needed_bytes() > data.size()) return false;
    if (!one->is_multiplexed) return true;
    const DbcSignal* selector = selector_of(message, *one);
    if (!selector || selector->signal.needed_bytes() > data.size() ||
        !has(one->selected_by, selector->signal.raw(data)))
      return false;
    one = selector;
  }
  return false;
}

}  // namespace

const DbcMessage* Dbc::find(std::uint32_t id, bool is_extended) const {
  for (const DbcMessage& message : messages)
    if (message.id == id && message.is_extended == is_extended) return &message;
  return nullptr;
}

Dbc read_dbc(std::string_view text) {
  Dbc out;
  Lines lines(text);
  std::string_view line;
  bool has_message = false;
  for (std::size_t number = 0; lines.next(line, number);) {
    Scanner in{line};
    const auto trouble = [&](const std::string& what) {
      out.troubles.push_back(fmt::format("line {}: {}", number, what));
    };
    if (in.take("BO_ ")) {
      DbcMessage message;
      std::uint32_t id = 0;
      has_message = false;
      if (!in.number(id)) {
        trouble("BO_ without an id");
        continue;
      }
      message.is_extended = has_29_bits(id);
      message.id = id & 0x1FFFFFFF;
      message.name = in.word(":");
      if (!in.take(":") || !in.number(message.length)) {
        trouble(fmt::format("BO_ {} without a length", id));
        continue;
      }
      has_message = true;
      out.messages.push_back(std::move(message));
    } else if (in.take("SG_ ")) {
      Result<DbcSignal> signal = parse_dbc_signal(line);
      if (!signal.ok())
        trouble(signal.error().message);
      else if (!has_message)
        trouble("SG_ before any BO_");
      else
        out.messages.back().signals.push_back(std::move(*signal));
    } else if (in.take("VAL_ ")) {
      take_words(in, out);
    } else if (in.take("SG_MUL_VAL_ ")) {
      take_selection(in, out);
    } else if (in.take("SIG_VALTYPE_ ")) {
      take_number_type(in, number, out);
    }
  }
  name_selectors(out);
  return out;
}

Result<std::vector<DbcMessage>> parse_dbc(std::string_view text) {
  Dbc dbc = read_dbc(text);
  if (!dbc.troubles.empty()) return Error{ErrorCode::Malformed, dbc.troubles.front()};
  return std::move(dbc.messages);
}

bool DbcSelection::holds(std::span<const std::uint8_t> data) const {
  return selector.needed_bytes() <= data.size() && has(values, selector.raw(data));
}

Result<std::vector<DbcSelection>> selections(const DbcMessage& message, const DbcSignal& signal) {
  std::vector<DbcSelection> out;
  for (const DbcSignal* one = &signal; one->is_multiplexed; one = selector_of(message, *one)) {
    const DbcSignal* selector = selector_of(message, *one);
    if (!selector || out.size() >= kSelectorsMost)
      return Error{ErrorCode::Malformed,
                   fmt::format("{}.{} is multiplexed, and the database does not say by what", message.name, one->name)};
    out.push_back({selector->signal, one->selected_by});
  }
  return out;
}

std::vector<DbcValue> decode(const DbcMessage& message, std::span<const std::uint8_t> data) {
  std::vector<DbcValue> out;
  for (const DbcSignal& signal : message.signals) {
    if (!is_there(message, signal, data)) continue;
    DbcValue value{&signal, signal.signal.raw(data), signal.signal.value(data), nullptr};
    if (const auto word = signal.words.find(value.raw); word != signal.words.end()) value.word = &word->second;
    out.push_back(value);
  }
  return out;
}

}  // namespace hueline::drivers
