#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "core/output_file.hpp"
#include "storage/cjk_font.hpp"
#include "storage/crc32.hpp"
#include "storage/pdf_page.hpp"
#include "storage/truetype_font.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline::storage {
namespace {

std::string words(const PdfText& text) {
  std::string out;
  for (const PdfLetter& one : text) out += one.code < 0x80 ? static_cast<char>(one.code) : '#';
  return out;
}

/// Returns whether qpdf, a PDF reader of other people, finds nothing wrong.
bool is_whole(const std::string& file) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(write_output(folder / "page.pdf", file).ok());
  return std::system(("qpdf --check '" + (folder / "page.pdf").string() + "' >/dev/null").c_str()) == 0;
}

std::string page_of(const std::string& text) {
  PdfPage page;
  double y = 40;
  for (const PdfText& line : lines_of(pdf_text(text), 10, 400, 50)) page.text({40, y += 12}, line, 10);
  return page.file(text);
}

TEST(PdfText, WidthsAreThoseOfHelvetica) {
  // By Adobe's font metrics: H 722, e 556, l 222, o 556; in bold H 722, e 556, l 278, o 611.
  EXPECT_DOUBLE_EQ(width_of(pdf_text("Hello"), 1000), 722 + 556 + 222 + 222 + 556);
  EXPECT_DOUBLE_EQ(width_of(pdf_text("Hello", true), 1000), 722 + 556 + 278 + 278 + 611);
  EXPECT_DOUBLE_EQ(width_of(pdf_text("路口"), 1000), 2000);
}

TEST(PdfText, WhatCannotBeDrawnIsNamed) {
  EXPECT_EQ(words(pdf_text("a\xff(b)\\\n")), "a\\xff(b)\\\\n");
  EXPECT_EQ(words(pdf_text("ok \u2713")), "ok \\u{2713}");
  EXPECT_EQ(words(pdf_text("\U0001F600")), "\\u{1f600}");
  EXPECT_EQ(pdf_text("路é€")[0].code, U'路');
  EXPECT_EQ(pdf_text("路é€").size(), 3u);
}

TEST(PdfText, LinesAreNotTooWideAndLoseNothing) {
  const std::string text = "a word, " + std::string(300, 'W') + " 路口路口路口路口 and the end";
  const PdfText all = pdf_text(text);
  std::string joined;
  for (const PdfText& line : lines_of(all, 10, 120, 1000)) {
    EXPECT_LE(width_of(line, 10), 120);
    EXPECT_FALSE(line.empty());
    joined += words(line);
  }
  std::string expected = words(all);
  std::erase(expected, ' ');
  std::erase(joined, ' ');
  EXPECT_EQ(joined, expected);

  const auto few = lines_of(all, 10, 120, 2);
  ASSERT_EQ(few.size(), 2u);
  EXPECT_EQ(few.back().back().code, U'\u2026');
  EXPECT_LE(width_of(few.back(), 10), 120);
  EXPECT_EQ(words(lines_of(pdf_text("two words"), 10, 120, 1).front()), "two words");
  EXPECT_TRUE(lines_of({}, 10, 120, 3).empty());
  EXPECT_EQ(lines_of(pdf_text("WWW"), 10, 1, 10).size(), 3u) << "a letter that is wider than a line has one of its own";
}

TEST(TrueTypeFont, APartOfAFontHasItsShapesAndTheirParts) {
  const TrueTypeFont font(cjk_font());
  EXPECT_EQ(font.glyph(U'A'), 0);
  EXPECT_EQ(font.glyph(0x1F600), 0);
  const std::vector<TrueTypeFont::Glyph> wanted{font.glyph(U'路'), font.glyph(U'口'), font.glyph(U'한')};
  for (const TrueTypeFont::Glyph one : wanted) EXPECT_NE(one, 0);
  const std::string part = font.subset(wanted);
  EXPECT_LT(part.size(), 10'000u) << "the whole font has 3.4 MB";
  EXPECT_EQ(part, font.subset(wanted));
  // By the format the words of the file sum up to this number.
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < part.size(); ++i)
    sum += static_cast<std::uint32_t>(static_cast<std::uint8_t>(part[i])) << (24 - 8 * (i % 4));
  EXPECT_EQ(sum, 0xB1B0AFBAu);
}

TEST(PdfPage, HasTheSameBytesOnEveryComputer) {
  PdfPage page;
  page.text({40, 60}, pdf_text("Drive (one) \\ 路口 é"), 11, {10, 20, 30});
  page.text({40, 80}, pdf_text("路", true), 11);
  page.lines(std::vector<PdfPlace>{{1.0 / 3, 2}, {3, 4}}, {{1, 2, 3}, 0.7, 3, 2});
  page.circle({100, 100}, 20, {});
  const std::string file = page.file("title");
  EXPECT_EQ(file, page.file("title"));
  EXPECT_EQ(crc32(0, as_bytes(file)), 865840782u);
  EXPECT_TRUE(is_whole(file));
}

TEST(PdfPage, AnyTextMakesAWholeFile) {
  for (const std::string& text : {std::string("(((("), std::string("))))"), std::string("\\"), std::string("\\)"),
                                  std::string("endstream endobj"), std::string("%%EOF"), std::string("\0\1\2", 3),
                                  std::string(), std::string(" "), std::string(9000, 'x'), std::string("\xe8\xb7"),
                                  std::string("\xed\xa0\x80"), std::string("\xf4\x90\x80\x80")})
    EXPECT_TRUE(is_whole(page_of(text))) << text;
  std::mt19937 random(1);
  for (int i = 0; i < 30; ++i) {
    std::string text(random() % 300, ' ');
    for (char& c : text) c = static_cast<char>(random() % 3 == 0 ? "()\\<>/%\n "[random() % 9] : random());
    EXPECT_TRUE(is_whole(page_of(text))) << i;
  }
  // Each character of the first plane of Unicode, so each shape of the font.
  for (char32_t first = 0x80; first < 0xFFFF; first += 0x1000) {
    std::string text;
    for (char32_t c = first; c < std::min<char32_t>(first + 0x1000, 0xFFFF); c += 3)
      if (c >= 0x800 && (c < 0xD800 || c > 0xDFFF)) {
        text += static_cast<char>(0xE0 | c >> 12);
        text += static_cast<char>(0x80 | (c >> 6 & 0x3F));
        text += static_cast<char>(0x80 | (c & 0x3F));
      }
    EXPECT_TRUE(is_whole(page_of(text))) << static_cast<std::uint32_t>(first);
  }
}

}  // namespace
}  // namespace hueline::storage
