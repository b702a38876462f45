#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "storage/arithmetic_coder.hpp"

/// The layers of a chunk of LAZ points (storage/laz_chunk.hpp). A layer codes one field of a record after the other:
/// code() gets the record, the record before it and what is known of the step between them. With an encoder it reads
/// the field from the record, with a decoder it writes the field to the record.
namespace hueline::storage::laz {

/// Where the fields of the formats 6 to 8 begin in a record.
constexpr std::size_t kX = 0, kY = 4, kZ = 8, kIntensity = 12, kReturns = 14, kFlags = 15, kClass = 16, kUser = 17,
                      kAngle = 18, kSource = 20, kTime = 22, kPoint14 = 30, kRed = 30, kNir = 36;

template <class T>
T load(const std::byte* record, std::size_t at) {
  T value;
  std::memcpy(&value, record + at, sizeof value);
  return value;
}
/// Writes the field if the coder decodes; `Byte` is const otherwise.
template <class Coder, class T, class Byte>
void store([[maybe_unused]] Byte* record, [[maybe_unused]] std::size_t at, [[maybe_unused]] T value) {
  if constexpr (Coder::kDecodes) std::memcpy(record + at, &value, sizeof value);
}

/// The scanner channel of a record, 0 to 3.
template <class Byte>
std::size_t channel_of(Byte* record) {
  return load<std::uint8_t>(record, kFlags) >> 4 & 3u;
}

/// What the first layer tells the others about the step from a record to the next.
struct Step {
  bool time_changed = false, source_changed = false, angle_changed = false;
  std::uint8_t level = 0;      ///< how many returns of the pulse lie behind this one
  std::uint8_t place = 0;      ///< of the return in its pulse: 3 only one, 2 first, 1 last, 0 between
  std::uint8_t z_context = 0;  ///< from the widths of x and y
};

/// The median of the last five values, roughly: each value pushes out the least or the greatest in turn.
class RunningMedian {
 public:
  std::int32_t value() const { return sorted_[2]; }
  void add(std::int32_t value) {
    // The value takes the place of an end, and moves to its place from there. Which end comes next depends on whether
    // the value was on the other side of the median.
    const std::int32_t median = sorted_[2];
    if (pushes_high_) {
      sorted_[4] = value;
      for (std::size_t i = 4; i > 0 && sorted_[i] < sorted_[i - 1]; --i) std::swap(sorted_[i], sorted_[i - 1]);
      if (value >= median) pushes_high_ = false;
    } else {
      sorted_[0] = value;
      for (std::size_t i = 0; i < 4 && sorted_[i] > sorted_[i + 1]; ++i) std::swap(sorted_[i], sorted_[i + 1]);
      if (value <= median) pushes_high_ = true;
    }
  }

 private:
  std::array<std::int32_t, 5> sorted_{};
  bool pushes_high_ = true;
};

/// Codes x or y, which begins at the byte `at`: the step from the record `last`, predicted by the middle of such steps.
template <class Coder, class Byte>
void code_axis(Coder& coder, IntegerModel& model, RunningMedian& middle, Byte* record, const std::byte* last,
               std::size_t at, std::size_t context) {
  const auto from = load<std::uint32_t>(last, at);
  const std::int32_t step =
      model.code(coder, middle.value(), static_cast<std::int32_t>(load<std::uint32_t>(record, at) - from), context);
  middle.add(step);
  store<Coder>(record, at, from + static_cast<std::uint32_t>(step));
}

/// The contexts of x and y: how a return stands among the returns of its pulse. `a` and `b` are the return's number and
/// the number of returns, in either order.
constexpr std::uint8_t return_context(std::uint32_t a, std::uint32_t b) {
  constexpr std::uint8_t kOfZero[] = {0, 1, 2, 3, 4, 5, 3, 4, 4, 5, 5, 5, 5, 5, 5, 5};
  if (a > b) return return_context(b, a);
  if (a == 0) return kOfZero[b];
  if (a == 1) return b == 1 ? 0 : b == 2 ? 1 : 3;
  if (a == 2) return b == 2 ? 2 : b <= 10 ? 4 : 3;
  return b == a || (a >= 11 && b == a + 1) ? 5 : 4;
}
inline constexpr auto kReturnContexts = [] {
  std::array<std::uint8_t, 256> out{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) out[byte] = return_context(byte & 15, byte >> 4);
  return out;
}();

/// A model for each context, made when the context is met.
class ContextModels {
 public:
  ContextModels(std::size_t contexts, std::uint32_t symbols) : models_(contexts), symbols_(symbols) {}
  SymbolModel& operator[](std::size_t context) {
    auto& model = models_[context];
    if (!model) model.emplace(symbols_);
    return *model;
  }

 private:
  std::vector<std::optional<SymbolModel>> models_;
  std::uint32_t symbols_;
};

/// Scanner channel, returns, x and y, and which of the other fields change. There is one object for each channel.
class PlaceLayer {
 public:
  static constexpr std::uint32_t kOtherChannel = 64;  ///< bit of a change

  /// Codes what changes: the first part of a record. The object is that of the record before, `before`; `last` is the
  /// last record of the new one's channel. `steps` counts the channels from the old to the new one, 0 to 3.
  template <class Coder, class Byte>
  std::uint32_t code_change(Coder& coder, Byte* record, const std::byte* before, const std::byte* last,
                            std::uint32_t& steps) {
    std::uint32_t change = 0;
    if constexpr (!Coder::kDecodes) {
      const std::uint32_t last_returns = load<std::uint8_t>(last, kReturns),
                          given = load<std::uint8_t>(record, kReturns);
      const std::uint32_t last_number = last_returns & 15, last_count = last_returns >> 4;
      const std::uint32_t given_number = given & 15, given_count = given >> 4;
      const std::uint32_t up = (given_number - last_number) & 15;
      change = std::uint32_t{up == 0    ? 0u
                             : up == 1  ? 1u
                             : up == 15 ? 2u
                                        : 3u} |
               (given_count != last_count) << 2 |
               (load<std::uint16_t>(record, kAngle) != load<std::uint16_t>(last, kAngle)) << 3 |
               (load<std::uint64_t>(record, kTime) != load<std::uint64_t>(last, kTime)) << 4 |
               (load<std::uint16_t>(record, kSource) != load<std::uint16_t>(last, kSource)) << 5 |
               (steps != 0 ? kOtherChannel : 0u);
    }
    const std::uint32_t returns = load<std::uint8_t>(before, kReturns), number = returns & 15, count = returns >> 4;
    const std::size_t context = (number == 1 ? 1u : 0u) | (number >= count ? 2u : 0u) | (time_changed_ ? 4u : 0u);
    change = coder.code(changes_[context], change);
    steps = change & kOtherChannel ? coder.code(channels_, steps - 1) + 1 : 0;
    return change;
  }

  /// Codes the rest. The object is that of the record's channel.
  template <class Coder, class Byte>
  Step code(Coder& coder, std::uint32_t change, Byte* record, const std::byte* last) {
    const std::uint32_t last_returns = load<std::uint8_t>(last, kReturns), given = load<std::uint8_t>(record, kReturns);
    const std::uint32_t last_number = last_returns & 15, last_count = last_returns >> 4;
    const std::uint32_t given_number = given & 15, given_count = given >> 4;
    Step step;
    step.angle_changed = change & 8;
    step.time_changed = time_changed_ = change & 16;
    step.source_changed = change & 32;
    const std::uint32_t count = change & 4 ? coder.code(counts_[last_count], given_count) : last_count;
    const std::uint32_t number = code_number(coder, change & 3, last_number, given_number);
    store<Coder>(record, kReturns, static_cast<std::uint8_t>(number | count << 4));

    const std::size_t single = count == 1;
    const std::size_t median = kReturnContexts[number | count << 4] * 2u + (time_changed_ ? 1u : 0u);
    code_axis(coder, x_, x_medians_[median], record, last, kX, single);
    code_axis(coder, y_, y_medians_[median], record, last, kY, single + (std::min(x_.width(), 20u) & ~1u));
    step.z_context = static_cast<std::uint8_t>(single + (std::min((x_.width() + y_.width()) / 2, 18u) & ~1u));
    step.level = static_cast<std::uint8_t>(std::min(number > count ? number - count : count - number, 7u));
    step.place = static_cast<std::uint8_t>((number == 1 ? 2 : 0) + (number >= count ? 1 : 0));
    return step;
  }

 private:
  /// `change`: 0 the same number, 1 and 2 the next and the last one (modulo 16), 3 another one.
  template <class Coder>
  std::uint32_t code_number(Coder& coder, std::uint32_t change, std::uint32_t last, std::uint32_t given) {
    if (change < 3) return (last + (change == 2 ? 15 : change)) & 15;
    if (time_changed_) return coder.code(numbers_[last], given);
    return (last + 2 + coder.code(jumps_, (given - last - 2) & 15)) & 15;
  }

  std::vector<SymbolModel> changes_ = std::vector(8, SymbolModel(128));
  ContextModels counts_{16, 16}, numbers_{16, 16};
  SymbolModel jumps_{13}, channels_{3};
  IntegerModel x_{32, 2}, y_{32, 22};
  std::array<RunningMedian, 12> x_medians_, y_medians_;
  bool time_changed_ = false;
};

class ZLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* before, const Step& step) {
    if (!std::exchange(has_begun_, true)) last_.fill(load<std::int32_t>(before, kZ));
    std::int32_t& last = last_[step.level];
    last = model_.code(coder, last, load<std::int32_t>(record, kZ), step.z_context);
    store<Coder>(record, kZ, last);
  }

 private:
  IntegerModel model_{32, 20};
  std::array<std::int32_t, 8> last_{};
  bool has_begun_ = false;
};

class IntensityLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* before, const Step& step) {
    if (!std::exchange(has_begun_, true)) last_.fill(load<std::uint16_t>(before, kIntensity));
    std::uint16_t& last = last_[step.place * 2u + (step.time_changed ? 1u : 0u)];
    last = static_cast<std::uint16_t>(model_.code(coder, last, load<std::uint16_t>(record, kIntensity), step.place));
    store<Coder>(record, kIntensity, last);
  }

 private:
  IntegerModel model_{16, 4};
  std::array<std::uint16_t, 8> last_{};
  bool has_begun_ = false;
};

class ClassLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, const Step& step) {
    const std::size_t context = (load<std::uint8_t>(last, kClass) & 31u) * 2 + (step.place == 3 ? 1 : 0);
    store<Coder>(record, kClass,
                 static_cast<std::uint8_t>(coder.code(models_[context], load<std::uint8_t>(record, kClass))));
  }

 private:
  ContextModels models_{64, 256};
};

/// Classification flags, direction of the scan and edge of the flight line: byte 15 without the scanner channel.
class FlagsLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, const Step&) {
    const auto byte = load<std::uint8_t>(record, kFlags);
    const std::uint32_t flags =
        coder.code(models_[without_channel(load<std::uint8_t>(last, kFlags))], without_channel(byte));
    store<Coder>(record, kFlags, static_cast<std::uint8_t>((flags & 15) | (byte & 0x30) | (flags & 0x30) << 2));
  }

 private:
  static std::uint32_t without_channel(std::uint8_t byte) { return (byte & 15u) | (byte & 0xC0u) >> 2; }
  ContextModels models_{64, 64};
};

class UserLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, const Step&) {
    SymbolModel& model = models_[load<std::uint8_t>(last, kUser) / 4u];
    store<Coder>(record, kUser, static_cast<std::uint8_t>(coder.code(model, load<std::uint8_t>(record, kUser))));
  }

 private:
  ContextModels models_{64, 256};
};

class AngleLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, const Step& step) {
    std::int32_t angle = load<std::int16_t>(last, kAngle);
    if (step.angle_changed)
      angle = model_.code(coder, angle, load<std::int16_t>(record, kAngle), step.time_changed ? 1 : 0);
    store<Coder>(record, kAngle, static_cast<std::int16_t>(angle));
  }

 private:
  IntegerModel model_{16, 2};
};

class SourceLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, const Step& step) {
    std::int32_t source = load<std::uint16_t>(last, kSource);
    if (step.source_changed) source = model_.code(coder, source, load<std::uint16_t>(record, kSource), 0);
    store<Coder>(record, kSource, static_cast<std::uint16_t>(source));
  }

 private:
  IntegerModel model_{16, 1};
};

/// GPS times, as the integers that have the same bits as the doubles. Up to four sequences of times run side by side.
/// In each, a time is predicted from a multiple of the last difference.
class TimeModel {
 public:
  /// `can_stay`: whether a time may be that of the record before. The formats 6 to 8 tell this in another layer.
  explicit TimeModel(bool can_stay) : can_stay_(can_stay) {}

  void begin(std::uint64_t time) { sequences_[0].time = time; }
  template <class Coder>
  std::uint64_t code(Coder& coder, std::uint64_t time) {
    std::uint32_t away = Coder::kDecodes ? 0 : find(time);
    // A damaged file can name one other sequence after another; the format's encoder does so once.
    for (int turn = 0;; ++turn) {
      Sequence& now = sequences_[current_];
      const auto given = static_cast<std::int32_t>(static_cast<std::uint32_t>(time - now.time));
      const bool is_first = now.difference == 0;
      // Where times can stay, that is the symbol before those of the other sequences, and the first of is_first.
      const std::uint32_t stays = is_first ? 0 : kNew, shift = can_stay_ ? 1 : 0;
      std::uint32_t symbol = away == 0   ? (is_first ? shift : symbol_of(given, now.difference))
                             : away == 4 ? (is_first ? 1 : kNew) + shift
                                         : (is_first ? away + 1 : kNew + away) + shift;
      if (can_stay_ && away == 0 && given == 0) symbol = stays;
      symbol = is_first ? coder.code(first_, symbol) : coder.code(multiples_, symbol);
      if (can_stay_ && symbol == stays) return now.time;
      if (symbol >= stays) symbol -= shift;
      if (is_first ? symbol == 0 : symbol < kNew) {
        const std::int32_t difference =
            is_first ? model_.code(coder, 0, given, 0) : code_multiple(coder, now, symbol, given);
        if (is_first) now.difference = difference, now.extremes = 0;
        now.time += static_cast<std::uint64_t>(static_cast<std::int64_t>(difference));
        return now.time;
      }
      const std::uint32_t other = is_first ? symbol - 1 : symbol - kNew;
      if (other == 0 || turn == 4) return start(coder, time);
      current_ = (current_ + other) & 3;
      away = 0;
    }
  }

 private:
  struct Sequence {
    std::uint64_t time = 0;
    std::int32_t difference = 0;
    int extremes = 0;  // how many differences in a row were no multiple of the last
  };
  static constexpr std::int32_t kMost = 500, kLeast = -10;  // the multiples
  // Symbols: 0 to 500 the multiple, 501 to 510 the multiples -1 to -10, then a new sequence, then another sequence.
  static constexpr std::uint32_t kNew = kMost - kLeast + 1;

  static bool fits(std::uint64_t time, const Sequence& sequence) {
    const auto difference = static_cast<std::int64_t>(time - sequence.time);
    return difference == static_cast<std::int32_t>(difference);
  }
  /// For the encoder: returns which sequence, counted from the current one, the time belongs to; 4 if to none.
  std::uint32_t find(std::uint64_t time) const {
    std::uint32_t away = 0;
    while (away < 4 && !fits(time, sequences_[(current_ + away) & 3])) ++away;
    return away;
  }

  template <class Coder>
  std::uint64_t start(Coder& coder, std::uint64_t time) {
    const auto high = static_cast<std::uint32_t>(model_.code(
        coder, static_cast<std::int32_t>(sequences_[current_].time >> 32), static_cast<std::int32_t>(time >> 32), 8));
    const std::uint32_t low = coder.code_bits(32, static_cast<std::uint32_t>(time));
    newest_ = current_ = (newest_ + 1) & 3;
    sequences_[current_] = {static_cast<std::uint64_t>(high) << 32 | low, 0, 0};
    return sequences_[current_].time;
  }
  static std::uint32_t symbol_of(std::int32_t difference, std::int32_t last) {
    const double ratio = static_cast<double>(static_cast<float>(difference) / static_cast<float>(last));
    const auto multiple =
        static_cast<std::int32_t>(std::clamp(ratio + (ratio >= 0 ? 0.5 : -0.5), double{kLeast}, double{kMost}));
    return static_cast<std::uint32_t>(multiple >= 0 ? multiple : kMost - multiple);
  }
  template <class Coder>
  std::int32_t code_multiple(Coder& coder, Sequence& now, std::uint32_t symbol, std::int32_t given) {
    const std::int32_t multiple = static_cast<std::int32_t>(symbol) <= kMost
                                      ? static_cast<std::int32_t>(symbol)
                                      : kMost - static_cast<std::int32_t>(symbol);
    const std::size_t context = multiple == 1        ? 1
                                : multiple == 0      ? 7
                                : multiple == kMost  ? 4
                                : multiple == kLeast ? 6
                                : multiple < 0       ? 5
                                : multiple < 10      ? 2
                                                     : 3;
    const auto prediction =
        static_cast<std::int32_t>(static_cast<std::uint32_t>(multiple) * static_cast<std::uint32_t>(now.difference));
    const std::int32_t difference = model_.code(coder, prediction, given, context);
    if (multiple == 1) now.extremes = 0;
    if ((multiple == 0 || multiple == kMost || multiple == kLeast) && ++now.extremes > 3) {
      now.difference = difference;
      now.extremes = 0;
    }
    return difference;
  }

  bool can_stay_;
  std::array<Sequence, 4> sequences_;
  std::uint32_t current_ = 0, newest_ = 0;
  SymbolModel multiples_{kNew + (can_stay_ ? 5u : 4u)}, first_{can_stay_ ? 6u : 5u};
  IntegerModel model_{32, 9};
};

class TimeLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, const Step& step) {
    std::uint64_t time = load<std::uint64_t>(last, kTime);
    if (!std::exchange(has_begun_, true)) model_.begin(time);
    if (step.time_changed) time = model_.code(coder, load<std::uint64_t>(record, kTime));
    store<Coder>(record, kTime, time);
  }

 private:
  TimeModel model_{false};
  bool has_begun_ = false;
};

/// Red, green and blue: first which of their six bytes change, then by how much. Green and blue are predicted from the
/// change of red.
class ColourModel {
 public:
  /// Codes the colours that begin at the byte `at` of a record.
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, std::size_t at) {
    std::array<std::uint8_t, 6> now{}, before{};  // red low, red high, green low, ...
    std::memcpy(now.data(), record + at, 6);
    std::memcpy(before.data(), last + at, 6);
    std::uint32_t changes = 0;
    if constexpr (!Coder::kDecodes) {
      for (std::size_t i = 0; i < 6; ++i) changes |= (now[i] != before[i] ? 1u : 0u) << i;
      const bool is_grey = std::memcmp(&now[0], &now[2], 2) == 0 && std::memcmp(&now[0], &now[4], 2) == 0;
      changes |= is_grey ? 0u : 64u;
    }
    changes = coder.code(changes_, changes);
    const auto code_byte = [&](std::size_t i, int prediction) {
      if (!(changes >> i & 1)) return now[i] = before[i], 0;
      now[i] = static_cast<std::uint8_t>(
          prediction + static_cast<int>(coder.code(bytes_[i], static_cast<std::uint8_t>(now[i] - prediction))));
      return now[i] - before[i];
    };
    int step[2];
    for (std::size_t high = 0; high < 2; ++high) step[high] = code_byte(high, before[high]);
    for (std::size_t high = 0; high < 2; ++high) {
      if (!(changes & 64)) {
        now[high + 2] = now[high + 4] = now[high];
        continue;
      }
      const int green = code_byte(high + 2, std::clamp(before[high + 2] + step[high], 0, 255));
      code_byte(high + 4, std::clamp(before[high + 4] + (step[high] + green) / 2, 0, 255));
    }
    store<Coder>(record, at, now);
  }

 private:
  SymbolModel changes_{128};
  std::vector<SymbolModel> bytes_ = std::vector(6, SymbolModel(256));
};

class ColourLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, const Step&) {
    model_.code(coder, record, last, kRed);
  }

 private:
  ColourModel model_;
};

class NirLayer {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, const Step&) {
    const auto now = load<std::uint16_t>(record, kNir), before = load<std::uint16_t>(last, kNir);
    const std::uint32_t changes =
        coder.code(changes_, ((now ^ before) & 0xFF ? 1u : 0u) | ((now ^ before) & 0xFF00 ? 2u : 0u));
    std::uint32_t value = 0;
    for (std::uint32_t high = 0; high < 2; ++high) {
      const std::uint32_t from = before >> 8 * high & 0xFFu;
      const std::uint32_t step =
          changes >> high & 1 ? coder.code(bytes_[high], (static_cast<std::uint32_t>(now >> 8 * high) - from) & 0xFF)
                              : 0;
      value |= ((from + step) & 0xFF) << 8 * high;
    }
    store<Coder>(record, kNir, static_cast<std::uint16_t>(value));
  }

 private:
  SymbolModel changes_{4};
  std::vector<SymbolModel> bytes_ = std::vector(2, SymbolModel(256));
};

/// One of the extra bytes.
class ByteLayer {
 public:
  explicit ByteLayer(std::size_t at) : at_(at) {}
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last, const Step& = {}) {
    const auto from = load<std::uint8_t>(last, at_);
    const std::uint32_t step = coder.code(model_, static_cast<std::uint8_t>(load<std::uint8_t>(record, at_) - from));
    store<Coder>(record, at_, static_cast<std::uint8_t>(from + step));
  }

 private:
  std::size_t at_;
  SymbolModel model_{256};
};

}  // namespace hueline::storage::laz
