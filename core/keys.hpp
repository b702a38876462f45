#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <concepts>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "core/time.hpp"

/// The keys of configuration files.
///
/// A Config declares each of its keys once, in `void visit(Keys& keys)`: the name, the unit, one plain sentence, the
/// member that holds the value, and the allowed range. The key's default is the initial value of the member:
///
///   void VelodyneDecoder::Config::visit(Keys& keys) {
///     keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m, {0, 131});
///     keys.angle({"azimuth_begin_deg", "deg", "Azimuths are kept clockwise from here ..."}, azimuth_begin,
///                {0, 360, Ends::MinOnly});
///
/// Visitors of this one list read files, check values, and write the tables of the documents and the JSON schema. So a
/// Config does not depend on YAML. Rules that concern several keys are checked by `KeyError validate() const` of the
/// Config, which calls check_keys(*this) first.
namespace hueline {

/// Which ends of a Range belong to it.
enum class Ends : std::uint8_t { Both, MinOnly, MaxOnly };

/// An interval of allowed numbers, in the unit of the key.
struct Range {
  double min, max;
  Ends ends = Ends::Both;

  /// Returns whether `value` lies in the interval.
  bool has(double value) const {
    return (ends == Ends::MaxOnly ? value > min : value >= min) && (ends == Ends::MinOnly ? value < max : value <= max);
  }
  /// Describes the interval for messages: "a number from 0 to below 360 deg".
  std::string allowed(std::string_view unit, bool is_whole) const;
};

/// The number of items that a list may have.
struct Count {
  std::size_t min = 0, max = std::numeric_limits<std::size_t>::max();
};

/// The form that a text must have. A form that no pattern can express has only `fits`.
struct TextForm {
  const char* allowed;  ///< the form in words, for messages and documents: "an IPv4 address"
  bool (*fits)(const std::string& text) = nullptr;  ///< checks the form; null accepts every text but the empty one
  const char* pattern = "";  ///< a regular expression for the JSON schema; empty if there is none
};
/// Accepts every text but the empty one.
extern const TextForm kAnyText;
/// Accepts addresses like "192.168.1.2".
extern const TextForm kIpv4Address;

/// The description of one key. `what` says in whole sentences what the key is for.
struct Key {
  std::string_view name, unit, what;
  std::string_view otherwise{};  ///< what the default means, or what holds if the key is left out: "measured"
  bool is_required = false;

  Key(std::string_view key, std::string_view unit_of_it, std::string_view sentence, std::string_view without = {})
      : name(key), unit(unit_of_it), what(sentence), otherwise(without) {}
};
/// Returns the description of a key without a default: every file must contain it.
inline Key required(std::string_view name, std::string_view unit, std::string_view what) {
  Key key(name, unit, what);
  key.is_required = true;
  return key;
}

/// The result of checking a Config: the first key that is wrong, or nothing.
struct KeyError {
  /// The wrong key as files name it; for a key inside a mapping with the mapping's name: "relation.pairs".
  std::string key;
  /// The rest of the sentence whose subject is the key: "is 17; allowed: a whole number from 0 to 15".
  std::string why;

  /// Returns true if nothing is wrong.
  bool empty() const { return why.empty(); }
  /// Returns the whole sentence: "neighbours is 17; allowed: a whole number from 0 to 15". Empty if nothing is wrong.
  std::string text() const { return empty() ? std::string() : key.empty() ? why : key + " " + why; }
  operator std::string() const { return text(); }
  friend bool operator==(const KeyError& error, std::string_view text) { return error.text() == text; }
  /// Returns the same error with the key named as seen from the enclosing mapping, by prefixing `section`.
  KeyError inside(std::string_view section) const;
};
/// Returns the error "KEY is FOUND; allowed: ALLOWED". All errors about values that are not allowed use this wording.
KeyError not_allowed(std::string_view key, std::string_view found, std::string_view allowed);

class Keys;

/// A Config behind a type-erased interface.
struct KeyGroup {
  std::function<void(Keys&)> visit;
  std::function<KeyError()> check;
};
/// A mapping that may be absent. `make` creates it if it is absent, and returns it.
struct KeySection {
  bool is_there = true;
  std::function<KeyGroup()> make;
};
/// A list of mappings.
struct KeyList {
  std::size_t size = 0;
  std::function<void()> clear;
  std::function<KeyGroup(std::size_t)> at;
  std::function<KeyGroup()> add;
};
/// A word that decides which further keys the same mapping has. The argument of `make` is the word's index in `words`.
struct KeyKinds {
  std::vector<std::string> words;
  std::optional<std::size_t> chosen;
  std::function<KeyGroup(std::size_t)> make;
  bool has_tables = false;  ///< each word has its own table in the documents
};

template <class T>
/// Wraps `config`, which must outlive the result. A Config without validate() has no further check.
KeyGroup group_of(T& config) {
  const auto walk = [&config](Keys& keys) { config.visit(keys); };
  if constexpr (requires { config.validate(); })
    return {walk, [&config] { return KeyError(config.validate()); }};
  else
    return {walk, [] { return KeyError{}; }};
}

/// Interface of the visitors of a list of keys. Each call names one key and the member that holds it. A visitor that
/// reads a file writes the member if the file contains the key, and the call then returns true. Other visitors leave
/// the member unchanged and return false.
class Keys {
 public:
  virtual ~Keys() = default;

  bool number(const Key& key, double& value, Range range) {
    std::optional<double> held = value;
    return take_number(key, held, range, false) && (value = *held, true);
  }
  bool number(const Key& key, std::optional<double>& value, Range range) {
    return take_number(key, value, range, false);
  }

  template <std::integral T>
  bool whole(const Key& key, T& value, Range range) {
    std::optional<double> held = static_cast<double>(value);
    return take_number(key, held, range, true) && (value = static_cast<T>(*held), true);
  }
  template <std::integral T>
  bool whole(const Key& key, std::optional<T>& value, Range range) {
    std::optional<double> held;
    if (value) held = static_cast<double>(*value);
    return take_number(key, held, range, true) && (value = static_cast<T>(*held), true);
  }

  /// An angle: the member is in radians; the key and its range are in degrees.
  bool angle(const Key& key, double& radians, Range degrees) {
    std::optional<double> held = radians / kRadPerDeg;
    return take_number(key, held, degrees, false) && (radians = *held * kRadPerDeg, true);
  }

  /// A duration. The key's unit is "s", "ms" or "us". A member that counts in whole units of the key accepts whole
  /// numbers only.
  template <class Rep, class Period>
  bool duration(const Key& key, std::chrono::duration<Rep, Period>& value, Range range) {
    std::optional<std::chrono::duration<Rep, Period>> held = value;
    return duration(key, held, range) && (value = *held, true);
  }
  template <class Rep, class Period>
  bool duration(const Key& key, std::optional<std::chrono::duration<Rep, Period>>& value, Range range,
                bool is_whole = false) {
    using Duration = std::chrono::duration<Rep, Period>;
    const Unit unit = unit_of(key.unit);
    std::optional<double> held;
    if (value) held = static_cast<double>(std::chrono::duration_cast<nanoseconds>(*value).count()) / unit.nanoseconds;
    is_whole |= static_cast<double>(std::chrono::duration_cast<nanoseconds>(Duration(1)).count()) >= unit.nanoseconds;
    if (!take_number(key, held, range, is_whole)) return false;
    value = std::chrono::duration_cast<Duration>(from_seconds(*held * unit.seconds));
    return true;
  }

  bool flag(const Key& key, bool& value) { return take_flag(key, value); }

  /// A text. The empty text means that there is none.
  bool text(const Key& key, std::string& value, const TextForm& form = kAnyText) { return take_text(key, value, form); }

  /// One word of a fixed set; each word stands for a value of the member.
  template <class T>
  bool choice(const Key& key, T& value, std::initializer_list<std::pair<const char*, T>> words) {
    std::vector<std::string> names;
    std::optional<std::size_t> chosen;
    for (const auto& [word, meaning] : words) {
      if (meaning == value) chosen = names.size();
      names.emplace_back(word);
    }
    return take_word(key, chosen, names) && (value = words.begin()[*chosen].second, true);
  }

  /// One word of a fixed set; the member holds the word's index.
  bool choice(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) {
    return take_word(key, chosen, words);
  }

  /// One word of a fixed set; the member holds the word itself.
  bool word(const Key& key, std::string& value, const std::vector<std::string>& words) {
    const auto found = std::find(words.begin(), words.end(), value);
    std::optional<std::size_t> chosen;
    if (found != words.end()) chosen = static_cast<std::size_t>(found - words.begin());
    return take_word(key, chosen, words) && (value = words[*chosen], true);
  }

  bool numbers(const Key& key, std::vector<double>& values, Range range, Count count = {}) {
    return take_numbers(key, values, range, count, false);
  }
  bool numbers(const Key& key, Eigen::Vector2d& values, Range range) { return fixed(key, values, range, false); }
  bool numbers(const Key& key, Eigen::Vector3d& values, Range range) { return fixed(key, values, range, false); }
  template <std::integral T>
  bool wholes(const Key& key, std::vector<T>& values, Range range, Count count = {}) {
    std::vector<double> held(values.begin(), values.end());
    if (!take_numbers(key, held, range, count, true)) return false;
    values.clear();
    for (const double value : held) values.push_back(static_cast<T>(value));
    return true;
  }
  template <std::integral T, std::size_t N>
  bool wholes(const Key& key, std::array<T, N>& values, Range range) {
    return fixed(key, values, range, true);
  }
  bool texts(const Key& key, std::vector<std::string>& values, const TextForm& form = kAnyText) {
    return take_texts(key, values, form);
  }

  /// A mapping. Its keys are those of T.
  template <class T>
  bool section(const Key& key, T& inside) {
    return take_section(key, {true, [&inside] { return group_of(inside); }});
  }
  template <class T>
  bool section(const Key& key, std::optional<T>& inside) {
    return take_section(key, {inside.has_value(), [&inside] {
                                if (!inside) inside = T{};
                                return group_of(*inside);
                              }});
  }
  /// A list of mappings. The keys of each are those of T.
  template <class T>
  bool list(const Key& key, std::vector<T>& items, Count count = {}) {
    return take_list(key,
                     {items.size(), [&items] { items.clear(); }, [&items](std::size_t i) { return group_of(items[i]); },
                      [&items] { return group_of(items.emplace_back()); }},
                     count);
  }
  bool list(const Key& key, const KeyList& items, Count count = {}) { return take_list(key, items, count); }
  /// A word, and the keys of the same mapping that this word brings with it.
  bool kinds(const Key& key, const KeyKinds& words) { return take_kind(key, words); }

  /// Declares that a file contains exactly one of these keys. The keys themselves are declared after this call.
  virtual void one_of(std::initializer_list<const char*> names) = 0;

 protected:
  /// `value` is what the member holds; it is empty if the member holds nothing yet. Returns true if a value from a file
  /// was put into `value`.
  virtual bool take_number(const Key& key, std::optional<double>& value, const Range& range, bool is_whole) = 0;
  virtual bool take_flag(const Key& key, bool& value) = 0;
  virtual bool take_text(const Key& key, std::string& value, const TextForm& form) = 0;
  virtual bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) = 0;
  virtual bool take_numbers(const Key& key, std::vector<double>& values, const Range& range, Count count,
                            bool is_whole) = 0;
  virtual bool take_texts(const Key& key, std::vector<std::string>& values, const TextForm& form) = 0;
  virtual bool take_section(const Key& key, const KeySection& section) = 0;
  virtual bool take_list(const Key& key, const KeyList& list, Count count) = 0;
  virtual bool take_kind(const Key& key, const KeyKinds& kinds) = 0;

 private:
  struct Unit {
    double seconds, nanoseconds;
  };
  static Unit unit_of(std::string_view unit);

  template <class Values>
  bool fixed(const Key& key, Values& values, Range range, bool is_whole) {
    std::vector<double> held(values.begin(), values.end());
    if (!take_numbers(key, held, range, {held.size(), held.size()}, is_whole)) return false;
    std::size_t i = 0;
    for (auto& value : values) value = static_cast<std::remove_reference_t<decltype(value)>>(held[i++]);
    return true;
  }
};

/// Checks every value of the group against its own list, and then the mappings inside it with their validate(). Returns
/// the first error.
KeyError check_group(const KeyGroup& group);

/// Checks every value of `config` against its own list of keys. Returns the first error.
template <class T>
KeyError check_keys(const T& config) {
  T copy = config;
  return check_group({[&copy](Keys& keys) { copy.visit(keys); }, {}});
}

/// Formats a number for messages and documents: "0.5", "360", "1e-06".
std::string number_text(double value);

}  // namespace hueline
