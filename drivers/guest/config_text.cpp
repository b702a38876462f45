#include "drivers/guest/config_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>
#include <vector>

namespace hueline::drivers {
namespace {

/// Keys that are plain values. Nothing that is sent to a guest has others: a list of keys that no test has walked.
class PlainKeys : public Keys {
 public:
  void one_of(std::initializer_list<const char*>) override {}

 protected:
  bool take_numbers(const Key&, std::vector<double>&, const Range&, Count, bool) override { std::abort(); }
  bool take_texts(const Key&, std::vector<std::string>&, const TextForm&) override { std::abort(); }
  bool take_section(const Key&, const KeySection&) override { std::abort(); }
  bool take_list(const Key&, const KeyList&, Count) override { std::abort(); }
  bool take_kind(const Key&, const KeyKinds&) override { std::abort(); }
};

class Writer final : public PlainKeys {
 public:
  std::string text;

 protected:
  bool take_number(const Key& key, std::optional<double>& value, const Range&, bool) override {
    return value && put(key, fmt::format("{}", *value));
  }
  bool take_flag(const Key& key, bool& value) override { return put(key, value ? "true" : "false"); }
  bool take_text(const Key& key, std::string& value, const TextForm&) override {
    std::string escaped;
    for (const char c : value) {
      if (c == '\n' || c == '\\') escaped += '\\';
      escaped += c == '\n' ? 'n' : c;
    }
    return !value.empty() && put(key, escaped);
  }
  bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) override {
    return chosen && put(key, words[*chosen]);
  }

 private:
  bool put(const Key& key, std::string_view value) {
    text += fmt::format("{} {}\n", key.name, value);
    return false;
  }
};

class Reader final : public PlainKeys {
 public:
  std::map<std::string_view, std::string_view> lines;  // not read yet
  std::string wrong;

 protected:
  bool take_number(const Key& key, std::optional<double>& value, const Range& range, bool is_whole) override {
    const auto line = lines.extract(key.name);
    if (line.empty()) return false;
    const std::string_view text = line.mapped();
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size() || !range.has(number) ||
        (is_whole && number != std::floor(number)))
      return refuse(key, text, range.allowed(key.unit, is_whole));
    value = number;
    return true;
  }
  bool take_flag(const Key& key, bool& value) override {
    const auto line = lines.extract(key.name);
    if (line.empty()) return false;
    value = line.mapped() == "true";
    return value || line.mapped() == "false" || refuse(key, line.mapped(), "true or false");
  }
  bool take_text(const Key& key, std::string& value, const TextForm&) override {
    const auto line = lines.extract(key.name);
    if (line.empty()) return false;
    const std::string_view text = line.mapped();
    value.clear();
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] != '\\') {
        value += text[i];
      } else if (++i < text.size()) {
        value += text[i] == 'n' ? '\n' : text[i];
      } else {
        return refuse(key, text, "a text, in which a backslash is followed by a backslash or n");
      }
    }
    return true;
  }
  bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) override {
    const auto line = lines.extract(key.name);
    if (line.empty()) return false;
    const auto word = std::find(words.begin(), words.end(), line.mapped());
    if (word == words.end()) return refuse(key, line.mapped(), fmt::format("{}", fmt::join(words, ", ")));
    chosen = static_cast<std::size_t>(word - words.begin());
    return true;
  }

 private:
  bool refuse(const Key& key, std::string_view found, std::string_view allowed) {
    if (wrong.empty()) wrong = not_allowed(key.name, fmt::format("'{}'", found), allowed).text();
    return false;
  }
};

}  // namespace

std::string write_config(const KeyGroup& group) {
  Writer writer;
  group.visit(writer);
  return std::move(writer.text);
}

Status read_config(std::string_view text, const KeyGroup& group) {
  Reader reader;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::size_t space = line.find(' ');
    if (space == std::string_view::npos)
      return Error{ErrorCode::Malformed, fmt::format("'{}' is no name with a value", line)};
    reader.lines[line.substr(0, space)] = line.substr(space + 1);
  }
  group.visit(reader);
  if (!reader.wrong.empty()) return Error{ErrorCode::Malformed, reader.wrong};
  if (!reader.lines.empty())
    return Error{ErrorCode::Malformed, fmt::format("{}: there is no such key", reader.lines.begin()->first)};
  return {};
}

}  // namespace hueline::drivers
