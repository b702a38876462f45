#include "core/keys.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

namespace hueline {
namespace {

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return ::inet_pton(AF_INET, text.c_str(), &address) == 1;
}

/// Compares the values of the members with what the list allows. A member may have been converted from another unit, so
/// an error in the last digits is accepted.
class Checker final : public Keys {
 public:
  KeyError found;

  void one_of(std::initializer_list<const char*>) override {}

 protected:
  bool take_number(const Key& key, std::optional<double>& value, const Range& range, bool is_whole) override {
    if (value) check(key, *value, range, is_whole);
    return false;
  }
  bool take_flag(const Key&, bool&) override { return false; }
  bool take_text(const Key& key, std::string& value, const TextForm& form) override {
    if (!value.empty() && form.fits && !form.fits(value)) keep(not_allowed(key.name, "'" + value + "'", form.allowed));
    return false;
  }
  bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) override {
    if (!chosen) keep(not_allowed(key.name, "none of its words", fmt::format("{}", fmt::join(words, ", "))));
    return false;
  }
  bool take_numbers(const Key& key, std::vector<double>& values, const Range& range, Count count,
                    bool is_whole) override {
    if (values.empty() && !key.is_required) return false;
    if (values.size() < count.min || values.size() > count.max)
      keep(not_allowed(key.name, fmt::format("a list of {}", values.size()), fmt::format("{} or more", count.min)));
    for (const double value : values) check(key, value, range, is_whole);
    return false;
  }
  bool take_texts(const Key& key, std::vector<std::string>& values, const TextForm& form) override {
    for (const std::string& value : values)
      if (value.empty() || (form.fits && !form.fits(value)))
        keep(not_allowed(key.name, "'" + value + "'", form.allowed));
    return false;
  }
  bool take_section(const Key& key, const KeySection& section) override {
    if (section.is_there) look_into(section.make(), std::string(key.name));
    return false;
  }
  bool take_list(const Key& key, const KeyList& list, Count count) override {
    if (list.size < count.min || list.size > count.max)
      keep(
          not_allowed(key.name, fmt::format("a list of {}", list.size), fmt::format("{} to {}", count.min, count.max)));
    for (std::size_t i = 0; i < list.size; ++i) look_into(list.at(i), fmt::format("{}[{}]", key.name, i));
    return false;
  }
  bool take_kind(const Key&, const KeyKinds&) override { return false; }

 private:
  void keep(KeyError error) {
    if (found.empty()) found = std::move(error);
  }
  void check(const Key& key, double value, const Range& range, bool is_whole) {
    const double slack = 1e-12 * std::max(std::abs(range.min), std::abs(range.max));
    const bool is_near = std::isfinite(value) && value >= range.min - slack && value <= range.max + slack;
    if (range.has(value) || (range.ends == Ends::Both && is_near)) return;
    keep(not_allowed(key.name, number_text(value), range.allowed(key.unit, is_whole)));
  }
  void look_into(const KeyGroup& group, const std::string& place) {
    if (!found.empty()) return;
    Checker inside;
    group.visit(inside);
    if (inside.found.empty()) inside.found = group.check();
    keep(inside.found.inside(place));
  }
};

}  // namespace

const TextForm kAnyText{"a text"};
const TextForm kIpv4Address{"an IPv4 address", is_ipv4, R"(^\d{1,3}(\.\d{1,3}){3}$)"};

std::string number_text(double value) {
  if (std::abs(value) >= 1e300) return value < 0 ? "-inf" : "inf";
  return std::abs(value) < 1e15 && value == std::floor(value) ? fmt::format("{:.0f}", value)
                                                              : fmt::format("{:.6g}", value);
}

std::string Range::allowed(std::string_view unit, bool is_whole) const {
  return fmt::format("a {} from {}{} to {}{}{}{}", is_whole ? "whole number" : "number",
                     ends == Ends::MaxOnly ? "above " : "", number_text(min), ends == Ends::MinOnly ? "below " : "",
                     number_text(max), unit.empty() ? "" : " ", unit);
}

KeyError KeyError::inside(std::string_view section) const {
  if (empty()) return {};
  return {fmt::format("{}{}{}", section, key.empty() ? "" : ".", key), why};
}

KeyError not_allowed(std::string_view key, std::string_view found, std::string_view allowed) {
  return {std::string(key), fmt::format("is {}; allowed: {}", found, allowed)};
}

Keys::Unit Keys::unit_of(std::string_view unit) {
  if (unit == "s") return {1, 1e9};
  if (unit == "ms") return {1e-3, 1e6};
  if (unit == "us") return {1e-6, 1e3};
  std::abort();  // programming error: no test has walked this list of keys
}

KeyError check_group(const KeyGroup& group) {
  Checker checker;
  group.visit(checker);
  return checker.found;
}

}  // namespace hueline
