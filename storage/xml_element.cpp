#include "storage/xml_element.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/number_word.hpp"

namespace hueline::storage {
namespace {

constexpr std::string_view kXmlBlanks = " \t\r\n";
constexpr std::size_t kMostNested = 64;

/// Appends a character of Unicode as UTF-8. Returns false if there is no such character.
bool append_character(std::uint32_t code, std::string& out) {
  if (code == 0 || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) return false;
  if (code < 0x80) {
    out += static_cast<char>(code);
    return true;
  }
  const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
  const std::uint32_t lead = more == 1 ? 0xC0 : more == 2 ? 0xE0 : 0xF0;
  out += static_cast<char>(lead | code >> (6 * more));
  for (int i = more - 1; i >= 0; --i) out += static_cast<char>(0x80 | (code >> (6 * i) & 0x3F));
  return true;
}

/// Appends what a reference such as &lt; or &#xB0; stands for; `word` is what is between "&" and ";".
bool append_reference(std::string_view word, std::string& out) {
  constexpr std::array<std::pair<std::string_view, char>, 5> kNamed{
      {{"lt", '<'}, {"gt", '>'}, {"amp", '&'}, {"quot", '"'}, {"apos", '\''}}};
  for (const auto& [named, character] : kNamed)
    if (word == named) {
      out += character;
      return true;
    }
  if (!word.starts_with('#')) return false;
  word.remove_prefix(1);
  const bool is_hex = word.starts_with('x');
  if (is_hex) word.remove_prefix(1);
  std::uint32_t code = 0;
  return read_number(word, code, is_hex ? 16 : 10) && append_character(code, out);
}

/// Reads the document from front to back. The open elements are a stack, so its depth is bounded.
class XmlParser {
 public:
  XmlParser(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  Result<XmlElement> parse() {
    std::vector<XmlElement> open;
    std::optional<XmlElement> root;
    while (at_ < text_.size()) {
      const std::size_t sign = std::min(text_.find('<', at_), text_.size());
      if (!open.empty() && !append_text(text_.substr(at_, sign - at_), open.back().text))
        return wrong("a reference (&...;) that is not known");
      at_ = sign;
      if (at_ == text_.size()) break;
      if (starts("<!--")) {
        if (!skip_behind("-->")) return wrong("a comment without an end");
      } else if (starts("<![CDATA[")) {
        const std::size_t begin = at_ + 9;
        if (!skip_behind("]]>")) return wrong("a CDATA section without an end");
        if (!open.empty()) open.back().text += text_.substr(begin, at_ - 3 - begin);
      } else if (starts("<?")) {
        if (!skip_behind("?>")) return wrong("an instruction without an end");
      } else if (starts("<!")) {
        if (!skip_behind(">")) return wrong("a declaration without an end");
      } else if (starts("</")) {
        at_ += 2;
        const std::string_view closed = take_name();
        skip_blanks();
        if (open.empty() || closed != open.back().name || !starts(">")) return wrong("a tag that closes no element");
        ++at_;
        close(open, root);
      } else {
        if (root) return wrong("a second root");
        if (open.size() == kMostNested)
          return Error{ErrorCode::Unsupported,
                       fmt::format("{}: its XML is nested more than {} deep", name_, kMostNested)};
        ++at_;
        Result<bool> is_empty = open_element(open);
        if (!is_empty.ok()) return is_empty.error();
        if (*is_empty) close(open, root);
      }
    }
    if (!root) return wrong(open.empty() ? "no element" : "its end, inside an element");
    return *std::move(root);
  }

 private:
  bool starts(std::string_view word) const { return text_.substr(at_).starts_with(word); }
  void skip_blanks() { at_ = std::min(text_.find_first_not_of(kXmlBlanks, at_), text_.size()); }
  bool skip_behind(std::string_view end) {
    const std::size_t found = text_.find(end, at_);
    if (found == std::string_view::npos) return false;
    at_ = found + end.size();
    return true;
  }
  std::string_view take_name() {
    const std::size_t end = std::min(text_.find_first_of(" \t\r\n/>=<\"'", at_), text_.size());
    const std::string_view word = text_.substr(at_, end - at_);
    at_ = end;
    return word;
  }
  Error wrong(const char* what) const {
    return {ErrorCode::Malformed, fmt::format("{}: at byte {} of its XML is {}", name_, at_, what)};
  }

  static bool append_text(std::string_view raw, std::string& out) {
    while (!raw.empty()) {
      const std::size_t sign = std::min(raw.find('&'), raw.size());
      out += raw.substr(0, sign);
      raw.remove_prefix(sign);
      if (raw.empty()) return true;
      const std::size_t end = raw.find(';');
      if (end == std::string_view::npos || !append_reference(raw.substr(1, end - 1), out)) return false;
      raw.remove_prefix(end + 1);
    }
    return true;
  }

  /// Reads a tag behind its "<" and opens its element. Returns whether the tag closes it, too.
  Result<bool> open_element(std::vector<XmlElement>& open) {
    XmlElement element;
    element.name = take_name();
    if (element.name.empty()) return wrong("a tag without a name");
    for (;;) {
      skip_blanks();
      const bool is_empty = starts("/>");
      if (is_empty || starts(">")) {
        at_ += is_empty ? 2 : 1;
        open.push_back(std::move(element));
        return is_empty;
      }
      std::pair<std::string, std::string> attribute;
      attribute.first = take_name();
      skip_blanks();
      if (attribute.first.empty() || !starts("=")) return wrong("a tag without an end");
      ++at_;
      skip_blanks();
      if (!starts("\"") && !starts("'")) return wrong("an attribute without a value");
      const std::size_t begin = at_ + 1, end = text_.find(text_[at_], begin);
      if (end == std::string_view::npos) return wrong("an attribute without an end");
      if (!append_text(text_.substr(begin, end - begin), attribute.second))
        return wrong("a reference (&...;) that is not known");
      at_ = end + 1;
      element.attributes.push_back(std::move(attribute));
    }
  }

  static void close(std::vector<XmlElement>& open, std::optional<XmlElement>& root) {
    XmlElement done = std::move(open.back());
    open.pop_back();
    if (open.empty())
      root = std::move(done);
    else
      open.back().children.push_back(std::move(done));
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
};

}  // namespace

const XmlElement* XmlElement::child(std::string_view wanted) const {
  const auto found = std::ranges::find(children, wanted, &XmlElement::name);
  return found == children.end() ? nullptr : &*found;
}

std::string_view XmlElement::attribute(std::string_view wanted) const {
  for (const auto& [key, value] : attributes)
    if (key == wanted) return value;
  return {};
}

Result<XmlElement> parse_xml(std::string_view text, const std::string& name) { return XmlParser(text, name).parse(); }

}  // namespace hueline::storage
