#include "core/printable.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <iterator>

#include "core/utf8.hpp"

namespace hueline {
namespace {

bool is_control(char32_t c) {
  return c < 0x20 || (c >= 0x7F && c < 0xA0)  // C0, DEL, C1
         || (c >= 0x200B && c <= 0x200F)      // zero width, direction marks
         || (c >= 0x2028 && c <= 0x202E)      // separators of lines and paragraphs, embedded directions
         || (c >= 0x2060 && c <= 0x206F) || c == 0x61C || c == 0xFEFF || (c >= 0xFFF9 && c <= 0xFFFB) || c >= 0xE0000;
}

}  // namespace

std::string printable(std::string_view text, LineEnds line_ends) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Utf8Character c = first_character(text);
    const std::size_t bytes = c.bytes == 0 ? 1 : c.bytes;
    if (c.bytes > 0 && (!is_control(c.code) || (c.code == '\n' && line_ends == LineEnds::Keep)))
      out += text.substr(0, bytes);
    else if (c.code == '\n' || c.code == '\r' || c.code == '\t')
      out += c.code == '\n' ? "\\n" : c.code == '\r' ? "\\r" : "\\t";
    else if (bytes == 1)
      fmt::format_to(std::back_inserter(out), "\\x{:02x}", static_cast<std::uint8_t>(text[0]));
    else
      fmt::format_to(std::back_inserter(out), "\\u{{{:x}}}", static_cast<std::uint32_t>(c.code));
    text.remove_prefix(bytes);
  }
  return out;
}

std::string as_markup(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string percent_encoded(std::string_view text, bool keeps_slashes) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~";
  std::string out;
  for (const char one : text)
    if (kPlain.find(one) != std::string_view::npos || (keeps_slashes && one == '/'))
      out += one;
    else
      out += fmt::format("%{:02X}", static_cast<unsigned char>(one));
  return out;
}

std::string percent_decoded(std::string_view text) {
  std::string out;
  for (std::size_t at = 0; at < text.size(); ++at) {
    unsigned char byte = 0;
    const char* const begin = text.data() + at + 1;
    if (text[at] == '%' && text.size() - at > 2 && std::from_chars(begin, begin + 2, byte, 16).ptr == begin + 2) {
      out += static_cast<char>(byte);
      at += 2;
    } else {
      out += text[at];
    }
  }
  return out;
}

}  // namespace hueline
