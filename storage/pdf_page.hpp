#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "storage/pdf_text.hpp"
#include "storage/png.hpp"

namespace hueline::storage {

/// A place on a page, in points (1/72 inch) from its left and upper edge.
struct PdfPlace {
  double x = 0, y = 0;
};

/// How a line is drawn.
struct PdfStroke {
  Rgb colour{};
  double width = 1;
  double dash = 0, gap = 0;  ///< lengths of the dashes and of what is between them; 0: no dashes
};

/// One page of A4 with texts and lines, written as a PDF 1.4 (ISO 32000-1). Latin letters are Helvetica, which every
/// reader has; the shapes of others are in the file. The file has no date and is not compressed: the same calls give
/// the same bytes, with any version of any library. What is drawn later lies above.
class PdfPage {
 public:
  static constexpr double kWidth = 595.28, kHeight = 841.89;

  /// Draws letters of this size from `at` on, the left end of the line on which they stand.
  void text(PdfPlace at, const PdfText& letters, double size, Rgb colour = {});
  void lines(std::span<const PdfPlace> places, const PdfStroke& stroke);
  void rectangle(PdfPlace upper_left, PdfPlace lower_right, Rgb colour);
  void frame(PdfPlace upper_left, PdfPlace lower_right, const PdfStroke& stroke);
  void circle(PdfPlace centre, double radius, const PdfStroke& stroke);
  void disc(PdfPlace centre, double radius, Rgb colour);
  void polygon(std::span<const PdfPlace> corners, Rgb colour);

  /// Returns the file. `title` is UTF-8, and what readers show above the page.
  std::string file(std::string_view title) const;

 private:
  void path(std::span<const PdfPlace> places);
  void round(PdfPlace centre, double radius);
  void stroke(const PdfStroke& stroke);

  std::string content_;
  std::map<char32_t, std::uint16_t> glyphs_;  // numbers of the characters of the CJK font that are used
};

}  // namespace hueline::storage
