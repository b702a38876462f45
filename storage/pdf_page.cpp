#include "storage/pdf_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "storage/cjk_font.hpp"
#include "storage/crc32.hpp"
#include "storage/truetype_font.hpp"

namespace hueline::storage {
namespace {

template <class... Args>
void print(std::string& out, fmt::format_string<Args...> form, Args&&... args) {
  fmt::format_to(std::back_inserter(out), form, std::forward<Args>(args)...);
}

std::string numbers(Rgb colour) {
  return fmt::format("{:.3f} {:.3f} {:.3f}", colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0);
}
double up(double y) { return PdfPage::kHeight - y; }  // PDF counts from the lower edge

void append_utf16(std::string& out, char32_t code) {
  if (code > 0xFFFF) {
    print(out, "{:04X}", 0xD800u + ((static_cast<std::uint32_t>(code) - 0x10000u) >> 10));
    print(out, "{:04X}", 0xDC00u + (static_cast<std::uint32_t>(code) & 0x3FFu));
  } else {
    print(out, "{:04X}", static_cast<std::uint32_t>(code));
  }
}

/// Returns the name of a part of a font: six letters that follow from the part, and the font's own name.
std::string subset_name(std::string_view font_file) {
  std::uint32_t rest = crc32(0, as_bytes(font_file));
  std::string out;
  for (int i = 0; i < 6; ++i, rest /= 26) out += static_cast<char>('A' + rest % 26);
  return out + "+DroidSansFallback";
}

}  // namespace

void PdfPage::text(PdfPlace at, const PdfText& letters, double size, Rgb colour) {
  if (letters.empty()) return;
  print(content_, "BT {} rg 1 0 0 1 {:.2f} {:.2f} Tm\n", numbers(colour), at.x, up(at.y));
  for (std::size_t begin = 0, end = 0; begin < letters.size(); begin = end) {
    const bool is_latin = win_ansi(letters[begin].code) != 0, is_bold = letters[begin].is_bold;
    const auto belongs = [&](const PdfLetter& one) {
      return (win_ansi(one.code) != 0) == is_latin && one.is_bold == is_bold;
    };
    while (end < letters.size() && belongs(letters[end])) ++end;
    const std::span run(letters.data() + begin, end - begin);
    if (is_latin) {
      print(content_, "/{} {:.2f} Tf (", is_bold ? "Bold" : "Plain", size);
      for (const PdfLetter& one : run) {
        const unsigned char byte = win_ansi(one.code);
        if (byte == '(' || byte == ')' || byte == '\\')
          print(content_, "\\{}", static_cast<char>(byte));
        else if (byte < 0x7F)
          content_ += static_cast<char>(byte);
        else
          print(content_, "\\{:03o}", byte);
      }
      content_ += ") Tj\n";
    } else {
      // The font has no bold shapes: the outlines are drawn besides.
      if (is_bold) print(content_, "2 Tr {:.2f} w {} RG ", size / 30, numbers(colour));
      print(content_, "/Cjk {:.2f} Tf <", size);
      for (const PdfLetter& one : run) {
        const auto number = static_cast<std::uint16_t>(glyphs_.size() + 1);
        print(content_, "{:04X}", glyphs_.try_emplace(one.code, number).first->second);
      }
      print(content_, "> Tj{}\n", is_bold ? " 0 Tr" : "");
    }
  }
  content_ += "ET\n";
}

void PdfPage::stroke(const PdfStroke& stroke) {
  print(content_, "{} RG {:.2f} w ", numbers(stroke.colour), stroke.width);
  if (stroke.dash > 0)
    print(content_, "[{:.2f} {:.2f}] 0 d\n", stroke.dash, stroke.gap);
  else
    content_ += "[] 0 d\n";
}

void PdfPage::path(std::span<const PdfPlace> places) {
  for (std::size_t i = 0; i < places.size(); ++i)
    print(content_, "{:.2f} {:.2f} {}\n", places[i].x, up(places[i].y), i == 0 ? 'm' : 'l');
}

void PdfPage::lines(std::span<const PdfPlace> places, const PdfStroke& how) {
  if (places.empty()) return;
  stroke(how);
  path(places);
  if (places.size() == 1) path(places), content_.replace(content_.size() - 2, 1, "l");  // a dot, by the round ends
  content_ += "S\n";
}

void PdfPage::rectangle(PdfPlace upper_left, PdfPlace lower_right, Rgb colour) {
  print(content_, "{} rg {:.2f} {:.2f} {:.2f} {:.2f} re f\n", numbers(colour), upper_left.x, up(lower_right.y),
        lower_right.x - upper_left.x, lower_right.y - upper_left.y);
}

void PdfPage::frame(PdfPlace upper_left, PdfPlace lower_right, const PdfStroke& how) {
  stroke(how);
  print(content_, "{:.2f} {:.2f} {:.2f} {:.2f} re S\n", upper_left.x, up(lower_right.y), lower_right.x - upper_left.x,
        lower_right.y - upper_left.y);
}

/// Appends a circle of four curves.
void PdfPage::round(PdfPlace centre, double radius) {
  const double x = centre.x, y = up(centre.y), r = radius, k = 0.5523 * radius;
  print(content_, "{:.2f} {:.2f} m\n", x + r, y);
  const auto curve = [&](double ax, double ay, double bx, double by, double ex, double ey) {
    print(content_, "{:.2f} {:.2f} {:.2f} {:.2f} {:.2f} {:.2f} c\n", ax, ay, bx, by, ex, ey);
  };
  curve(x + r, y + k, x + k, y + r, x, y + r);
  curve(x - k, y + r, x - r, y + k, x - r, y);
  curve(x - r, y - k, x - k, y - r, x, y - r);
  curve(x + k, y - r, x + r, y - k, x + r, y);
}

void PdfPage::circle(PdfPlace centre, double radius, const PdfStroke& how) {
  stroke(how);
  round(centre, radius);
  content_ += "s\n";
}

void PdfPage::disc(PdfPlace centre, double radius, Rgb colour) {
  print(content_, "{} rg\n", numbers(colour));
  round(centre, radius);
  content_ += "f\n";
}

void PdfPage::polygon(std::span<const PdfPlace> corners, Rgb colour) {
  print(content_, "{} rg\n", numbers(colour));
  path(corners);
  content_ += "f\n";
}

std::string PdfPage::file(std::string_view title) const {
  std::string out = "%PDF-1.4\n%\xE2\xE3\xCF\xD3\n";  // the second line says that the file is not plain text
  std::vector<std::size_t> places;
  const auto object = [&](std::string_view body) {
    places.push_back(out.size());
    print(out, "{} 0 obj\n", places.size());
    out += body;
    out += "\nendobj\n";
  };
  const auto stream = [&](std::string_view entries, std::string_view bytes) {
    object(fmt::format("<< {}/Length {} >>\nstream\n{}\nendstream", entries, bytes.size(), bytes));
  };
  std::string utf16 = "FEFF";
  for (const PdfLetter& one : pdf_text(title)) append_utf16(utf16, one.code);
  object("<< /Type /Catalog /Pages 2 0 R /Lang (en) /ViewerPreferences << /DisplayDocTitle true >> >>");
  object("<< /Type /Pages /Kids [3 0 R] /Count 1 >>");
  object(
      fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.2f} {:.2f}] /Contents 4 0 R /Resources << /Font << "
                  "/Plain 5 0 R /Bold 6 0 R{} >> >> >>",
                  kWidth, kHeight, glyphs_.empty() ? "" : " /Cjk 8 0 R"));
  stream("", "1 J 1 j\n" + content_);  // lines with round ends and corners
  object("<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>");
  object("<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica-Bold /Encoding /WinAnsiEncoding >>");
  object(fmt::format("<< /Title <{}> /Creator (hueline) >>", utf16));
  if (!glyphs_.empty()) {
    const TrueTypeFont font(cjk_font());
    std::vector<std::pair<std::uint16_t, char32_t>> used;  // by their numbers
    for (const auto& [code, number] : glyphs_) used.emplace_back(number, code);
    std::ranges::sort(used);
    std::vector<TrueTypeFont::Glyph> shapes;
    std::string widths, unicode;
    for (std::size_t i = 0; i < used.size(); ++i) {
      shapes.push_back(font.glyph(used[i].second));
      print(widths, "{} ", font.width(shapes.back()));
      // The format allows a hundred in a block.
      if (i % 100 == 0) print(unicode, "{} beginbfchar\n", std::min<std::size_t>(100, used.size() - i));
      print(unicode, "<{:04X}> <", used[i].first);
      append_utf16(unicode, used[i].second);
      unicode += ">\n";
      if (i % 100 == 99 || i + 1 == used.size()) unicode += "endbfchar\n";
    }
    const std::string shapes_file = font.subset(shapes), name = subset_name(shapes_file);
    const std::vector<int> box = font.box();
    object(
        fmt::format("<< /Type /Font /Subtype /Type0 /BaseFont /{} /Encoding /Identity-H /DescendantFonts [9 0 R] "
                    "/ToUnicode 12 0 R >>",
                    name));
    object(
        fmt::format("<< /Type /Font /Subtype /CIDFontType2 /BaseFont /{} /CIDSystemInfo << /Registry (Adobe) /Ordering "
                    "(Identity) /Supplement 0 >> /FontDescriptor 10 0 R /CIDToGIDMap /Identity /W [1 [{}]] >>",
                    name, widths));
    object(
        fmt::format("<< /Type /FontDescriptor /FontName /{} /Flags 4 /FontBBox [{} {} {} {}] /ItalicAngle 0 /Ascent {} "
                    "/Descent {} /CapHeight {} /StemV 80 /FontFile2 11 0 R >>",
                    name, box[0], box[1], box[2], box[3], font.ascent(), font.descent(), font.ascent()));
    stream(fmt::format("/Length1 {} ", shapes_file.size()), shapes_file);
    stream("",
           "/CIDInit /ProcSet findresource begin\n12 dict begin\nbegincmap\n/CIDSystemInfo << /Registry (Adobe) "
           "/Ordering (UCS) /Supplement 0 >> def\n/CMapName /Adobe-Identity-UCS def\n/CMapType 2 def\n"
           "1 begincodespacerange\n<0000> <FFFF>\nendcodespacerange\n" +
               unicode + "endcmap\nCMapName currentdict /CMap defineresource pop\nend\nend");
  }
  const std::size_t table = out.size();
  print(out, "xref\n0 {}\n0000000000 65535 f \n", places.size() + 1);
  for (const std::size_t place : places) print(out, "{:010} 00000 n \n", place);
  print(out, "trailer\n<< /Size {} /Root 1 0 R /Info 7 0 R >>\nstartxref\n{}\n%%EOF\n", places.size() + 1, table);
  return out;
}

}  // namespace hueline::storage
