#include "config/key_reader.hpp"

#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace hueline::config {
namespace {

class KeyReader final : public Keys {
 public:
  explicit KeyReader(Section& section) : section_(section) {}

  void one_of(std::initializer_list<const char*> names) override { section_.one_of({names.begin(), names.end()}); }

 protected:
  bool take_number(const Key& key, std::optional<double>& value, const Range& range, bool is_whole) override {
    if (!is_there(key)) return false;
    value = is_whole ? static_cast<double>(section_.integer(name(key), range, key.unit))
                     : section_.number(name(key), range, key.unit);
    return true;
  }
  bool take_flag(const Key& key, bool& value) override {
    if (!is_there(key)) return false;
    value = section_.boolean(name(key), value);
    return true;
  }
  bool take_text(const Key& key, std::string& value, const TextForm& form) override {
    if (!is_there(key)) return false;
    value = section_.text(name(key), form);
    return true;
  }
  bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) override {
    if (!is_there(key)) return false;
    chosen = read_word(key, words);
    return true;
  }
  bool take_numbers(const Key& key, std::vector<double>& values, const Range& range, Count count,
                    bool is_whole) override {
    if (!is_there(key)) return false;
    values = section_.numbers(name(key), range, key.unit, count, is_whole);
    return true;
  }
  bool take_texts(const Key& key, std::vector<std::string>& values, const TextForm& form) override {
    if (!is_there(key)) return false;
    values = section_.texts(name(key), form);
    return true;
  }
  bool take_section(const Key& key, const KeySection& section) override {
    if (!is_there(key)) return false;
    read_whole(section_.section(name(key)), section.make());
    return true;
  }
  bool take_list(const Key& key, const KeyList& list, Count count) override {
    if (!is_there(key)) return false;
    const std::vector<Section> items = section_.list(name(key));
    if (items.size() < count.min || items.size() > count.max)
      section_.refuse(name(key), not_allowed("", fmt::format("a list of {}", items.size()),
                                             fmt::format("a list of {} to {}", count.min, count.max))
                                     .why);
    list.clear();
    for (const Section& item : items) read_whole(item, list.add());
    return true;
  }
  bool take_kind(const Key& key, const KeyKinds& kinds) override {
    std::optional<std::size_t> chosen = kinds.chosen;
    const bool is_given = is_there(key);
    if (is_given) chosen = read_word(key, kinds.words);
    if (chosen) read_keys(section_, kinds.make(*chosen));
    return is_given;
  }

 private:
  static std::string name(const Key& key) { return std::string(key.name); }
  /// Returns whether the key is present. For a required key it returns true, so that reading it reports that it is
  /// missing.
  bool is_there(const Key& key) const { return section_.has(name(key)) || key.is_required; }

  std::size_t read_word(const Key& key, const std::vector<std::string>& words) {
    std::vector<std::pair<std::string, std::size_t>> places;
    for (const std::string& word : words) places.emplace_back(word, places.size());
    return section_.choice(name(key), places);
  }
  static void read_whole(Section section, const KeyGroup& group) {
    read_keys(section, {group.visit, [&] {
                          section.finish();
                          return group.check();
                        }});
  }

  Section& section_;
};

}  // namespace

void read_keys(Section& section, const KeyGroup& group) {
  KeyReader reader(section);
  group.visit(reader);
  if (const KeyError wrong = group.check(); !wrong.empty()) section.refuse(wrong.key, wrong.why);
}

}  // namespace hueline::config
