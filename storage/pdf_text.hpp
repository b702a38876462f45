#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace hueline::storage {

/// A character of a text in a PDF, which can be drawn: it is one of Windows-1252, which every reader has in Helvetica,
/// or one of cjk_font().
struct PdfLetter {
  char32_t code = 0;
  bool is_bold = false;
  bool operator==(const PdfLetter&) const = default;
};
using PdfText = std::vector<PdfLetter>;

/// Returns a text of any origin as letters. What cannot be drawn is named, as printable() names bytes and control
/// characters: "\x{ff}" stands for a byte that is not UTF-8, "\u{2713}" for a character without a shape.
PdfText pdf_text(std::string_view utf8, bool is_bold = false);

/// Returns the width of a text in the unit of `size`, the size of its letters.
double width_of(const PdfText& text, double size);

/// Returns the lines of a text that is not to be wider than `width`. Lines end at spaces, between Chinese, Japanese or
/// Korean characters, or in a word that is wider than a line. With more than `most` lines the last one ends with an
/// ellipsis. The empty text has no lines.
std::vector<PdfText> lines_of(const PdfText& text, double size, double width, std::size_t most);

/// Returns the byte of a character in Windows-1252, which PDF calls WinAnsiEncoding; 0 if it has none there.
unsigned char win_ansi(char32_t code);

}  // namespace hueline::storage
