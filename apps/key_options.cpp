#include "apps/key_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <stdexcept>
#include <utility>

#include "config/section.hpp"
#include "core/number_word.hpp"

namespace hueline::apps {
namespace {

std::string option_of(const Key& key) {
  std::string out = "--" + std::string(key.name);
  std::replace(out.begin(), out.end(), '_', '-');
  return out;
}

/// Returns a key's sentences as a help's words.
std::string help_of(const Key& key) {
  std::string out(key.what);
  std::erase(out, '`');
  if (out.ends_with('.')) out.pop_back();
  if (!out.empty()) out[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(out[0])));
  if (!key.otherwise.empty()) out += fmt::format("; default: {}", key.otherwise);
  return out;
}

/// A visitor of keys that have one value each.
class OneValue : public Keys {
 public:
  void one_of(std::initializer_list<const char*>) override {}

 protected:
  bool take_number(const Key& key, std::optional<double>& value, const Range& range, bool is_whole) override {
    std::string text = value ? number_text(*value) : std::string();
    const std::string before = text;
    take(key, text, {}, range.allowed(key.unit, is_whole));
    if (text == before) return false;
    value = parse_number<double>(text);
    const double whole = value ? static_cast<double>(static_cast<std::int64_t>(*value)) : 0;
    if (!value || !range.has(*value) || (is_whole && whole != *value))
      refuse(key, text, range.allowed(key.unit, is_whole));
    return true;
  }
  bool take_text(const Key& key, std::string& value, const TextForm& form) override {
    std::string text = value;
    take(key, text, {}, {});
    if (text == value) return false;
    if (form.fits ? !form.fits(text) : text.empty()) refuse(key, text, form.allowed);
    value = text;
    return true;
  }
  bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) override {
    std::string text = chosen ? words[*chosen] : std::string();
    take(key, text, words, {});
    const auto found = std::find(words.begin(), words.end(), text);
    if (found == words.end()) return false;  // the command line has refused it
    chosen = static_cast<std::size_t>(found - words.begin());
    return true;
  }
  bool take_flag(const Key& key, bool&) override { return is_no_option(key); }
  bool take_numbers(const Key& key, std::vector<double>&, const Range&, Count, bool) override {
    return is_no_option(key);
  }
  bool take_texts(const Key& key, std::vector<std::string>&, const TextForm&) override { return is_no_option(key); }
  bool take_section(const Key& key, const KeySection&) override { return is_no_option(key); }
  bool take_list(const Key& key, const KeyList&, Count) override { return is_no_option(key); }
  bool take_kind(const Key& key, const KeyKinds&) override { return is_no_option(key); }

  /// `text` is the value of the member; what is left in it becomes the value. `words`: all that are allowed, if they
  /// are few. `allowed`: in words, if the help must say it.
  virtual void take(const Key& key, std::string& text, const std::vector<std::string>& words,
                    const std::string& allowed) = 0;

 private:
  [[noreturn]] static void refuse(const Key& key, const std::string& text, const std::string& allowed) {
    throw config::ConfigError(not_allowed(option_of(key), "'" + text + "'", allowed).text());
  }
  static bool is_no_option(const Key& key) {
    throw std::logic_error(fmt::format("the key {} cannot be an option", key.name));
  }
};

class Declarer final : public OneValue {
 public:
  Declarer(Command& command, std::map<std::string, std::string>& given, const std::string& before)
      : command_(command), given_(given), before_(before) {}

 private:
  void take(const Key& key, std::string& text, const std::vector<std::string>& words,
            const std::string& allowed) override {
    const auto [at, is_new] = given_.emplace(option_of(key), text);
    if (!is_new) return;
    const std::string help = before_ + help_of(key) + (allowed.empty() ? std::string() : fmt::format("; {}", allowed));
    if (text.empty())
      command_.option(at->first, at->second, help);
    else
      command_.setting(at->first, at->second, help, words);
  }

  Command& command_;
  std::map<std::string, std::string>& given_;
  const std::string& before_;
};

class Reader final : public OneValue {
 public:
  explicit Reader(const std::map<std::string, std::string>& given) : given_(given) {}

 private:
  void take(const Key& key, std::string& text, const std::vector<std::string>&, const std::string&) override {
    if (const auto found = given_.find(option_of(key)); found != given_.end()) text = found->second;
  }

  const std::map<std::string, std::string>& given_;
};

class Writer final : public OneValue {
 public:
  std::vector<std::pair<std::string, std::string>> out;  // options and their values

 private:
  void take(const Key& key, std::string& text, const std::vector<std::string>&, const std::string&) override {
    out.emplace_back(option_of(key), text);
  }
};

}  // namespace

void KeyOptions::declare(Command& command, const KeyGroup& group, const std::string& before) {
  Declarer declarer(command, given_, before);
  group.visit(declarer);
}

void KeyOptions::read(const KeyGroup& group) const {
  Reader reader(given_);
  group.visit(reader);
}

std::vector<std::string> option_words(const KeyGroup& group, const KeyGroup& defaults) {
  Writer given, otherwise;
  group.visit(given);
  defaults.visit(otherwise);
  std::vector<std::string> out;
  for (std::size_t i = 0; i < given.out.size(); ++i)
    if (given.out[i] != otherwise.out.at(i)) out.insert(out.end(), {given.out[i].first, given.out[i].second});
  return out;
}

}  // namespace hueline::apps
