#include "config/key_documents.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <sstream>
#include <utility>

#include "config/rig.hpp"
#include "config/section.hpp"

namespace hueline::config {
namespace {

constexpr std::string_view kBegin = "<!-- keys ", kEnd = "<!-- end of keys -->";

std::string words_text(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += fmt::format("{}`{}`", out.empty() ? "" : ", ", word);
  return out;
}

/// Walks down to the mapping that `path` names, and writes a row for each of its keys.
class TableWriter final : public Keys {
 public:
  TableWriter(std::span<const std::string> path, bool has_paths, std::string prefix, std::string& out)
      : path_(path), has_paths_(has_paths), prefix_(std::move(prefix)), out_(out) {}

  void one_of(std::initializer_list<const char*> names) override { one_of_.assign(names.begin(), names.end()); }

 protected:
  bool take_number(const Key& key, std::optional<double>& value, const Range& range, bool is_whole) override {
    row(key, value ? number_text(*value) : "", allowed(range, is_whole));
    return false;
  }
  bool take_flag(const Key& key, bool& value) override {
    row(key, value ? "true" : "false", "true, false");
    return false;
  }
  bool take_text(const Key& key, std::string& value, const TextForm& form) override {
    row(key, value, form.allowed);
    return false;
  }
  bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) override {
    row(key, chosen ? "`" + words[*chosen] + "`" : "", words_text(words));
    return false;
  }
  bool take_numbers(const Key& key, std::vector<double>& values, const Range& range, Count count,
                    bool is_whole) override {
    std::string text;
    for (const double value : values) text += (text.empty() ? "[" : ", ") + number_text(value);
    row(key, text.empty() ? "" : text + "]",
        (count.min == count.max ? fmt::format("{} x ", count.min) : "list of ") + allowed(range, is_whole));
    return false;
  }
  bool take_texts(const Key& key, std::vector<std::string>&, const TextForm& form) override {
    row(key, "", fmt::format("list; each item is {}", form.allowed));
    return false;
  }
  bool take_section(const Key& key, const KeySection& section) override {
    if (is_next(key.name)) descend(section.make(), key.name, "");
    row(key, "", "mapping");
    return false;
  }
  bool take_list(const Key& key, const KeyList& list, Count count) override {
    if (is_next(key.name)) descend(list.add(), key.name, "[]");
    const bool is_bounded = count.max != Count{}.max;
    row(key, "", is_bounded ? fmt::format("list of {} to {} mappings", count.min, count.max) : "list of mappings");
    return false;
  }
  bool take_kind(const Key& key, const KeyKinds& kinds) override {
    row(key, kinds.chosen ? "`" + kinds.words[*kinds.chosen] + "`" : "", words_text(kinds.words));
    for (std::size_t i = 0; i < kinds.words.size(); ++i) {
      if (!kinds.has_tables)
        kinds.make(i).visit(*this);
      else if (is_next(kinds.words[i]))
        descend(kinds.make(i), "", "");
    }
    return false;
  }

 private:
  static std::string allowed(const Range& range, bool is_whole) {
    return fmt::format("{}{} .. {}{}{}", range.ends == Ends::MaxOnly ? "above " : "", number_text(range.min),
                       range.ends == Ends::MinOnly ? "below " : "", number_text(range.max), is_whole ? ", whole" : "");
  }
  bool is_next(std::string_view name) const { return !path_.empty() && path_.front() == name; }
  void descend(const KeyGroup& group, std::string_view name, std::string_view brackets) {
    std::string prefix = name.empty() ? prefix_ : fmt::format("{}{}{}.", prefix_, name, brackets);
    TableWriter inside(path_.subspan(1), has_paths_, std::move(prefix), out_);
    group.visit(inside);
  }
  void row(const Key& key, const std::string& value, const std::string& allowed) {
    if (!path_.empty()) return;
    std::string what(key.what);
    if (!one_of_.empty() && one_of_.front() == key.name)
      what += " Exactly one of " + words_text(one_of_) + " is there.";
    out_ += fmt::format("| `{}{}` | {} | {} | {} | {} |\n", has_paths_ ? prefix_ : "", key.name, key.unit,
                        key.is_required          ? "-"
                        : !key.otherwise.empty() ? std::string(key.otherwise)
                                                 : value,
                        allowed, what);
  }

  const std::span<const std::string> path_;
  const bool has_paths_;
  const std::string prefix_;
  std::string& out_;
  std::vector<std::string> one_of_;
};

/// Returns the table that a marker asks for: "rig sensors velodyne", or several mappings, "scenario alley + traffic".
/// Empty if the marker names nothing.
std::string table_of(std::string_view marker, const std::vector<KeyDocument>& lists) {
  std::istringstream words{std::string(marker)};
  std::string name, rows;
  words >> name;
  const auto list = std::ranges::find(lists, name, &KeyDocument::name);
  if (list == lists.end()) return {};
  std::vector<std::string> path;
  const auto write = [&] {
    const std::size_t before = rows.size();
    TableWriter writer(path, list->has_paths, "", rows);
    list->visit(writer);
    path.clear();
    return rows.size() > before;
  };
  for (std::string word; words >> word;) {
    if (word != "+")
      path.push_back(word);
    else if (!write())
      return {};
  }
  return write() ? "| key | unit | default | allowed | what |\n|---|---|---|---|---|\n" + rows : std::string();
}

}  // namespace

KeyDocument rig_document() {
  return {"rig", [](Keys& keys) { visit_rig_keys(keys); }};
}

std::string with_key_tables(const std::string& document, const std::vector<KeyDocument>& lists) {
  std::string out;
  std::istringstream lines(document);
  bool is_skipping = false;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line == kEnd) is_skipping = false;
    if (!is_skipping) out += line + "\n";
    if (!line.starts_with(kBegin) || !line.ends_with(" -->")) continue;
    const std::string table =
        table_of(std::string_view(line).substr(kBegin.size(), line.size() - kBegin.size() - 4), lists);
    if (table.empty()) throw ConfigError(fmt::format("line {}: '{}' names no list of keys", number, line));
    if (is_skipping) throw ConfigError(fmt::format("line {}: the table above has no end: '{}'", number, kEnd));
    out += table;
    is_skipping = true;
  }
  if (is_skipping) throw ConfigError(fmt::format("the last table has no end: '{}'", kEnd));
  return out;
}

}  // namespace hueline::config
