#include "storage/pdf_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "core/printable.hpp"
#include "core/utf8.hpp"
#include "storage/cjk_font.hpp"
#include "storage/truetype_font.hpp"

namespace hueline::storage {
namespace {

// The widths of the letters of Helvetica and Helvetica-Bold in thousandths of their size, from the byte 32 of
// Windows-1252 on. Readers bring these fonts or others of the same widths.
// clang-format off
constexpr std::array<std::uint16_t, 224> kPlain{
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556, 556,
    556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667,
    556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, 333, 556,
    556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722,
    500, 500, 500, 334, 260, 334, 584, 0, 556, 0, 222, 556, 333, 1000, 556, 556, 333, 1000, 667, 333, 1000, 0,
    611, 0, 0, 222, 222, 333, 333, 350, 556, 1000, 333, 1000, 500, 333, 944, 0, 500, 667, 278, 333, 556, 556, 556,
    556, 260, 556, 333, 737, 370, 556, 584, 333, 737, 333, 400, 584, 333, 333, 333, 556, 537, 278, 333, 333, 365,
    556, 834, 834, 834, 611, 667, 667, 667, 667, 667, 667, 1000, 722, 667, 667, 667, 667, 278, 278, 278, 278, 722,
    722, 778, 778, 778, 778, 778, 584, 778, 722, 722, 722, 722, 667, 667, 611, 556, 556, 556, 556, 556, 556, 889,
    500, 556, 556, 556, 556, 278, 278, 278, 278, 556, 556, 556, 556, 556, 556, 556, 584, 611, 556, 556, 556, 556,
    500, 556, 500};
constexpr std::array<std::uint16_t, 224> kBold{
    278, 333, 474, 556, 556, 889, 722, 238, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556, 556,
    556, 556, 556, 556, 333, 333, 584, 584, 584, 611, 975, 722, 722, 722, 722, 667, 611, 778, 722, 278, 556, 722,
    611, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 333, 278, 333, 584, 556, 333, 556,
    611, 556, 611, 556, 333, 611, 611, 278, 278, 556, 278, 889, 611, 611, 611, 611, 389, 556, 333, 611, 556, 778,
    556, 556, 500, 389, 280, 389, 584, 0, 556, 0, 278, 556, 500, 1000, 556, 556, 333, 1000, 667, 333, 1000, 0,
    611, 0, 0, 278, 278, 500, 500, 350, 556, 1000, 333, 1000, 556, 333, 944, 0, 500, 667, 278, 333, 556, 556, 556,
    556, 280, 556, 333, 737, 370, 556, 584, 333, 737, 333, 400, 584, 333, 333, 333, 611, 556, 278, 333, 333, 365,
    556, 834, 834, 834, 611, 722, 722, 722, 722, 722, 722, 1000, 722, 667, 667, 667, 667, 278, 278, 278, 278, 722,
    722, 778, 778, 778, 778, 778, 584, 778, 722, 722, 722, 722, 667, 667, 611, 556, 556, 556, 556, 556, 556, 889,
    556, 556, 556, 556, 556, 278, 278, 278, 278, 611, 611, 611, 611, 611, 611, 611, 584, 611, 611, 611, 611, 611,
    556, 611, 556};
// clang-format on

/// The characters of Windows-1252 from the byte 0x80 to 0x9F; 0 where it has none.
constexpr std::array<char32_t, 32> kFrom80{0x20AC, 0,      0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021,
                                           0x02C6, 0x2030, 0x0160, 0x2039, 0x0152, 0,      0x017D, 0,
                                           0,      0x2018, 0x2019, 0x201C, 0x201D, 0x2022, 0x2013, 0x2014,
                                           0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0,      0x017E, 0x0178};

const TrueTypeFont& font() {
  static const TrueTypeFont out{cjk_font()};
  return out;
}

double width_of(const PdfLetter& letter, double size) {
  const unsigned char byte = win_ansi(letter.code);
  if (byte == 0) return font().width(font().glyph(letter.code)) * size / 1000;
  return (letter.is_bold ? kBold : kPlain)[byte - 32u] * size / 1000;
}

}  // namespace

unsigned char win_ansi(char32_t code) {
  if ((code >= 0x20 && code < 0x7F) || (code >= 0xA0 && code <= 0xFF)) return static_cast<unsigned char>(code);
  const auto found = std::ranges::find(kFrom80, code);
  return code == 0 || found == kFrom80.end() ? static_cast<unsigned char>(0)
                                             : static_cast<unsigned char>(0x80 + (found - kFrom80.begin()));
}

PdfText pdf_text(std::string_view utf8, bool is_bold) {
  PdfText out;
  const std::string safe = printable(utf8);
  for (std::string_view rest = safe; !rest.empty();) {
    const auto [code, bytes] = first_character(rest);
    rest.remove_prefix(bytes);  // printable text is valid UTF-8
    if (win_ansi(code) != 0 || font().glyph(code) != 0) {
      out.push_back({code, is_bold});
    } else {
      for (const char c : fmt::format("\\u{{{:x}}}", static_cast<std::uint32_t>(code)))
        out.push_back({static_cast<char32_t>(c), is_bold});
    }
  }
  return out;
}

double width_of(const PdfText& text, double size) {
  double out = 0;
  for (const PdfLetter& one : text) out += width_of(one, size);
  return out;
}

std::vector<PdfText> lines_of(const PdfText& text, double size, double width, std::size_t most) {
  std::vector<PdfText> out;
  const auto is_wide = [&](std::size_t i) { return win_ansi(text[i].code) == 0; };
  for (std::size_t begin = 0; begin < text.size() && out.size() < most;) {
    std::size_t end = begin, last_break = begin;
    double used = 0;
    for (; end < text.size(); ++end) {
      if (end > begin && (text[end].code == ' ' || (is_wide(end) && is_wide(end - 1)))) last_break = end;
      used += width_of(text[end], size);
      if (used > width && end > begin && text[end].code != ' ') break;
    }
    if (end < text.size() && last_break > begin) end = last_break;
    PdfText line(text.begin() + static_cast<std::ptrdiff_t>(begin), text.begin() + static_cast<std::ptrdiff_t>(end));
    while (!line.empty() && line.back().code == ' ') line.pop_back();
    begin = end;
    while (begin < text.size() && text[begin].code == ' ') ++begin;
    if (out.size() + 1 == most && begin < text.size()) {
      const PdfLetter ellipsis{0x2026, false};
      while (!line.empty() && width_of(line, size) + width_of(ellipsis, size) > width) line.pop_back();
      line.push_back(ellipsis);
    }
    out.push_back(std::move(line));
  }
  return out;
}

}  // namespace hueline::storage
