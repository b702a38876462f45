#include "runtime/sensor_values.hpp"

#include <optional>
#include <utility>
#include <vector>

#include "core/keys.hpp"

namespace hueline::runtime {
namespace {

/// Collects the values of a device's keys as text, by their names ("udp.ports").
class KeyValues final : public Keys {
 public:
  std::map<std::string, std::string> values;
  void one_of(std::initializer_list<const char*>) override {}

 private:
  bool note(const Key& key, std::string value) {
    if (!value.empty()) values[prefix_ + std::string(key.name)] = std::move(value);
    return false;
  }
  bool take_number(const Key& key, std::optional<double>& value, const Range&, bool) override {
    return note(key, value ? number_text(*value) : "");
  }
  bool take_flag(const Key& key, bool& value) override { return note(key, value ? "true" : "false"); }
  bool take_text(const Key& key, std::string& value, const TextForm&) override { return note(key, value); }
  bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) override {
    return note(key, chosen ? words[*chosen] : "");
  }
  bool take_numbers(const Key& key, std::vector<double>& numbers, const Range&, Count, bool) override {
    std::string text;
    for (const double number : numbers) text += number_text(number) + " ";
    return note(key, text);
  }
  bool take_texts(const Key& key, std::vector<std::string>& texts, const TextForm&) override {
    std::string all;
    for (const std::string& text : texts) all += text + " ";
    return note(key, all);
  }
  bool take_section(const Key& key, const KeySection& section) override {
    if (!section.is_there) return false;
    const std::string before = prefix_;
    prefix_ += std::string(key.name) + ".";
    section.make().visit(*this);
    prefix_ = before;
    return false;
  }
  bool take_list(const Key&, const KeyList&, Count) override { return false; }
  bool take_kind(const Key&, const KeyKinds&) override { return false; }
  std::string prefix_;
};

}  // namespace

std::map<std::string, std::string> values_of(const config::Sensor& sensor) {
  KeyValues keys;
  // Declaring keys to a visitor that writes nothing changes nothing; it is not const because readers do write.
  const_cast<drivers::Device&>(*sensor.device).visit(keys);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  return std::move(keys.values);
}

}  // namespace hueline::runtime
