#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/report_content.hpp"
#include "storage/pdf_page.hpp"

namespace hueline::runtime {
namespace {

using storage::lines_of;
using storage::pdf_text;
using storage::PdfPage;
using storage::PdfPlace;
using storage::PdfStroke;
using storage::PdfText;
using storage::Rgb;
using storage::width_of;
using Map = ReportContent::Map;
using Line = ReportContent::Line;

// Lengths are points: 1/72 inch.
constexpr double kLeft = 36, kRight = PdfPage::kWidth - 36, kTop = 36, kBottom = PdfPage::kHeight - 34;
constexpr double kWide = kRight - kLeft;
constexpr double kSize = 8.5, kLead = 11;                 // of the texts, and from line to line
constexpr double kHeading = 21;                           // the height of a heading with what is above it
constexpr double kLeastMap = 150, kMostMap = 330;         // heights of the map
constexpr double kIndent = 22, kWhat = 92, kWanted = 62;  // widths of numbers and of columns

constexpr Rgb kBlack{17, 17, 17}, kGrey{95, 95, 95}, kPale{205, 205, 205}, kPaper{250, 250, 250}, kWhite{255, 255, 255};
constexpr Rgb kWeak{26, 79, 196}, kMark{106, 27, 154};
constexpr std::array<Rgb, 3> kGrades{Rgb{10, 92, 43}, Rgb{150, 92, 0}, Rgb{161, 0, 24}};
constexpr std::array<PdfStroke, 4> kStrokes{PdfStroke{{145, 145, 145}, 1.4}, PdfStroke{{18, 129, 63}, 2.8},
                                            PdfStroke{{217, 130, 0}, 2.8, 5.5, 5}, PdfStroke{{192, 0, 28}, 2.8, 1, 5}};
constexpr std::array<const char*, 4> kLineWords{"driven only", "coloured", "too few colours", "no points"};

const PdfStroke& stroke_of(Line line) { return kStrokes[static_cast<std::size_t>(line)]; }
Rgb colour_of(Grade grade) { return kGrades[static_cast<std::size_t>(grade)]; }

/// Returns the text as letters; of a very long one its beginning, for nobody reads more of it on a page.
PdfText letters(std::string_view text, bool is_bold = false) {
  constexpr std::size_t kMost = 2000;
  PdfText out = pdf_text(text.substr(0, kMost), is_bold);
  if (text.size() > kMost) out.push_back({0x2026, is_bold});
  return out;
}
PdfText operator+(PdfText first, const PdfText& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

/// One entry of a list or of a table: lines beside a number or a word.
struct Entry {
  PdfText label;
  std::vector<PdfText> lines;
  std::vector<PdfText> beside;  ///< lines of the last column
  Rgb colour = kBlack;
  double height() const { return kLead * static_cast<double>(std::max(lines.size(), beside.size())); }
};

std::vector<Entry> reasons(const ReportContent& content) {
  std::vector<Entry> out;
  for (const auto& [grade, sensor, text, when] : content.reasons) {
    if (out.size() == content.kReasons) break;
    const PdfText words =
        letters((grade == Grade::Again ? "drive again: " : "") + sensor, true) + letters(": " + text) + letters(when);
    out.push_back({letters(fmt::format("{}.", out.size() + 1), true),
                   lines_of(words, kSize, kWide - kIndent, 4),
                   {},
                   colour_of(grade)});
  }
  return out;
}

std::vector<Entry> marks(const ReportContent& content) {
  std::vector<Entry> out;
  for (const auto& [label, where, note] : content.marks) {
    if (out.size() == content.kMarks) break;
    const PdfText words = letters(where) + letters(note.empty() ? "" : "  ") + letters(note);
    out.push_back({letters(label, true), lines_of(words, kSize, kWide - kIndent, 3), {}, kBlack});
  }
  return out;
}

std::vector<Entry> figures(const ReportContent& content) {
  std::vector<Entry> out;
  out.push_back({{}, {letters("measured", true)}, {letters("wanted", true)}, kGrey});
  for (const auto& [what, measured, wanted] : content.figures)
    out.push_back({letters(what, true), lines_of(letters(measured), kSize, kWide - kWhat - kWanted - 8, 3),
                   lines_of(letters(wanted), kSize, kWanted, 2), kBlack});
  return out;
}

double height_of(std::span<const Entry> entries) {
  double out = 0;
  for (const Entry& one : entries) out += one.height();
  return out;
}

/// Removes entries from the end until the rest has at most this height, with the line that says how many are missing.
void cut(std::vector<Entry>& entries, std::size_t all, double height) {
  const auto needed = [&] { return height_of(entries) + (entries.size() < all ? kLead : 0); };
  while (!entries.empty() && needed() > height) entries.pop_back();
}

/// Returns "and 3 more in report.html", or where else they are; nothing if none is missing.
std::string missing(std::size_t listed, std::size_t all, std::size_t in_html) {
  if (listed == all) return {};
  return fmt::format("and {} more in {}", all - listed, all > in_html ? "summary.json" : "report.html");
}

/// Writes the report from the upper edge of the page down.
class Report {
 public:
  explicit Report(const ReportContent& content) : content_(content) {}

  std::string file() {
    // The figures are always whole. Reasons and marks get the room that the smallest map leaves, the map the rest.
    const std::vector<Entry> table = figures(content_);
    std::vector<Entry> why = reasons(content_), flags = marks(content_);
    const double fixed =
        kTop + kHead + kHeading + height_of(table) + 1.5 * static_cast<double>(table.size()) + kHeading;
    const double key = content_.map ? kKey : 0, least = content_.map ? kLeastMap : 20;
    double room = kBottom - fixed - key - least;
    const double for_marks = flags.empty() ? 0 : kHeading + std::min(height_of(flags) + kLead, 4 * kLead);
    cut(why, content_.reasons.size(), room - for_marks);
    room -= std::max(height_of(why), kLead) + (why.size() < content_.reasons.size() ? kLead : 0);
    if (!flags.empty()) {
      cut(flags, content_.marks.size(), room - kHeading);
      room -= kHeading + height_of(flags) + (flags.size() < content_.marks.size() ? kLead : 0);
    }
    head();
    if (content_.map)
      map(std::min(least + room, kMostMap), why.size(), flags.size());
    else
      line(kNoMap);
    heading(kReasonsTitle);
    if (content_.reasons.empty()) line(kNoReason);
    list(why, missing(why.size(), content_.reasons.size(), content_.kReasons));
    if (!content_.marks.empty()) {
      heading(kMarksTitle);
      list(flags, missing(flags.size(), content_.marks.size(), content_.kMarks));
    }
    heading("Figures");
    rows(table);
    page_.text({kLeft, PdfPage::kHeight - 24}, letters("hueline; the thresholds are the keys health of the rig."), 7,
               kGrey);
    return page_.file(fmt::format("Drive of {}: {}", shortened(content_.rig), name(content_.grade)));
  }

 private:
  static constexpr double kHead = 64, kKey = 16;

  static std::string shortened(const std::string& text) { return text.substr(0, 200); }

  /// Draws the rig's name, and the verdict in large letters.
  void head() {
    const auto title = lines_of(letters("Drive of the rig " + content_.rig, true), 15, kWide, 1);
    page_.text({kLeft, kTop + 10}, title.front(), 15, kBlack);
    const double top = kTop + 20, bottom = top + 34, middle = (top + bottom) / 2;
    page_.rectangle({kLeft, top}, {kRight, bottom}, colour_of(content_.grade));
    sign({kLeft + 22, middle});
    page_.text({kLeft + 44, middle + 7.5}, letters(name(content_.grade), true), 22, kWhite);
    y_ = bottom + 10;
  }

  /// Draws a sign for the verdict, so that it does not depend on its colour: a hook, an exclamation mark, a cross.
  void sign(PdfPlace at) {
    const PdfStroke white{kWhite, 3.2};
    const auto place = [&](double x, double y) { return PdfPlace{at.x + x, at.y + y}; };
    const auto draw = [&](const std::vector<PdfPlace>& places) { page_.lines(places, white); };
    if (content_.grade == Grade::Good) draw({place(-8, 1), place(-2, 7), place(9, -7)});
    if (content_.grade == Grade::Remarks) draw({place(0, -9), place(0, 2)}), page_.disc(place(0, 8), 2, kWhite);
    if (content_.grade == Grade::Again) draw({place(-7, -7), place(7, 7)}), draw({place(-7, 7), place(7, -7)});
  }

  void line(std::string_view words) {
    y_ += kLead;
    page_.text({kLeft, y_ - 2.5}, letters(words), kSize, kBlack);
  }

  void heading(const char* words) {
    y_ += kHeading;
    page_.text({kLeft, y_ - 5}, letters(words, true), 10.5, kBlack);
  }

  void entry(const Entry& one, double indent) {
    page_.text({kLeft, y_ + kLead - 2.5}, one.label, kSize, one.colour);
    for (std::size_t i = 0; i < one.lines.size(); ++i)
      page_.text({kLeft + indent, y_ + kLead * static_cast<double>(i + 1) - 2.5}, one.lines[i], kSize, one.colour);
    for (std::size_t i = 0; i < one.beside.size(); ++i)
      page_.text({kRight - kWanted, y_ + kLead * static_cast<double>(i + 1) - 2.5}, one.beside[i], kSize, one.colour);
    y_ += one.height();
  }

  void list(const std::vector<Entry>& entries, const std::string& rest) {
    for (const Entry& one : entries) entry(one, kIndent);
    if (!rest.empty()) line(rest);
  }

  void rows(const std::vector<Entry>& entries) {
    for (const Entry& one : entries) {
      entry(one, kWhat);
      y_ += 1.5;
      page_.lines(std::array{PdfPlace{kLeft, y_ - 0.5}, PdfPlace{kRight, y_ - 0.5}}, {kPale, 0.5});
    }
  }

  /// Draws the map with this height, and its key. Only what is listed below it has its number on it.
  void map(double height, std::size_t listed_reasons, std::size_t listed_marks) {
    const Map& map = *content_.map;
    const double top = y_, bottom = y_ + height;
    page_.rectangle({kLeft, top}, {kRight, bottom}, kPaper);
    double west = std::numeric_limits<double>::max(), east = -west, north = west, south = -west;
    const auto is_place = [](const ReportMap::Place& at) { return std::isfinite(at.x) && std::isfinite(at.y); };
    const auto hold = [&](const ReportMap::Place& at) {
      if (!is_place(at)) return;
      west = std::min(west, at.x), east = std::max(east, at.x);
      north = std::min(north, at.y), south = std::max(south, at.y);
    };
    for (const Map::Path& path : map.paths) std::ranges::for_each(path.places, hold);
    for (const auto* labels : {&map.remarks, &map.marks})
      for (const Map::Label& one : *labels) hold(one.at);
    if (west > east) west = east = north = south = 0;
    constexpr double kEdge = 22, kLowEdge = 34;  // what numbers and the scale need beside the lines
    const double scale = std::min({(kWide - 2 * kEdge) / std::max(east - west, 1e-3),
                                   (height - kEdge - kLowEdge) / std::max(south - north, 1e-3), 1.0});
    const auto on_page = [&](const ReportMap::Place& at) {
      return PdfPlace{(kLeft + kRight) / 2 + (at.x - (west + east) / 2) * scale,
                      (top + kEdge + bottom - kLowEdge) / 2 + (at.y - (north + south) / 2) * scale};
    };
    for (const Map::Path& path : map.paths) {
      std::vector<PdfPlace> places;
      for (const auto& at : path.places)
        if (is_place(at)) places.push_back(on_page(at));
      page_.lines(places, stroke_of(path.line));
    }
    for (const auto& at : map.weak)
      if (is_place(at)) page_.circle(on_page(at), 3.2, {kWeak, 0.9});
    std::vector<Label> labels;
    for (const auto& [at, number] : map.remarks)
      if (is_place(at) && number <= listed_reasons) labels.push_back({std::to_string(number), on_page(at)});
    for (const auto& [at, number] : map.marks)
      if (is_place(at) && number <= listed_marks) labels.push_back({fmt::format("M{}", number), on_page(at), true});
    place(labels, top, bottom);
    for (const Label& one : labels) leader(one);
    for (const Label& one : labels) label(one);
    scale_and_north(map.px_per_m * scale, top, bottom);
    page_.frame({kLeft, top}, {kRight, bottom}, {kPale, 0.8});
    y_ = bottom;
    key();
  }

  /// A number on the map, and where it is drawn.
  struct Label {
    std::string words;
    PdfPlace of;  ///< what it belongs to
    bool is_mark = false;
    PdfPlace at{};
    double half = 0;  ///< of its width
  };

  /// Chooses for each label a place near its own where no other is, not even the scale's bar or north.
  static void place(std::vector<Label>& labels, double top, double bottom) {
    struct Taken {
      PdfPlace at;
      double half;
    };
    std::vector<Taken> taken{{{kRight - 16, top + 18}, 8}, {{kLeft + 85, bottom - 11}, 80}};
    const auto is_free = [&](const Label& one) {
      const bool is_inside = one.at.x > kLeft + one.half + 1 && one.at.x < kRight - one.half - 1 &&
                             one.at.y > top + 7 && one.at.y < bottom - 7;
      return is_inside && std::ranges::none_of(taken, [&](const Taken& other) {
               return std::abs(other.at.x - one.at.x) < other.half + one.half + 1.5 &&
                      std::abs(other.at.y - one.at.y) < 14;
             });
    };
    constexpr std::array<PdfPlace, 8> kWays{PdfPlace{1, 0}, {0.7, -0.7}, {0, -1}, {-0.7, -0.7},
                                            {-1, 0},        {-0.7, 0.7}, {0, 1},  {0.7, 0.7}};
    for (Label& one : labels) {
      one.half = one.is_mark ? width_of(letters(one.words, true), 7) / 2 + 2.5 : 6.3;
      const PdfPlace first = one.is_mark ? PdfPlace{one.of.x, one.of.y - 13} : one.of;
      one.at = first;
      for (int ring = 1; ring <= 24 && !is_free(one); ++ring)
        for (const PdfPlace& way : kWays) {
          one.at = {first.x + 9 * ring * way.x, first.y + 9 * ring * way.y};
          if (is_free(one)) break;
        }
      if (!is_free(one)) one.at = first;
      taken.push_back({one.at, one.half});
    }
  }

  /// Draws a line from a label to where it belongs.
  void leader(const Label& one) {
    if (one.at.x != one.of.x || one.at.y != one.of.y)
      page_.lines(std::array{one.of, one.at}, {one.is_mark ? kMark : kBlack, 0.8});
  }

  void label(const Label& one) {
    const PdfText number = letters(one.words, true);
    const double half = width_of(number, 7) / 2;
    if (one.is_mark) {
      page_.rectangle({one.at.x - one.half, one.at.y - 5}, {one.at.x + one.half, one.at.y + 5}, kMark);
    } else {
      page_.disc(one.at, one.half, kWhite);
      page_.circle(one.at, one.half, {kBlack, 1.1});
    }
    page_.text({one.at.x - half, one.at.y + 2.5}, number, 7, one.is_mark ? kWhite : kBlack);
  }

  /// Draws a bar of a round length, and where north is, into the corners of the map.
  void scale_and_north(double points_per_m, double top, double bottom) {
    const ScaleBar bar = scale_bar(points_per_m, 110);
    const double length = bar.length_m * points_per_m, x = kLeft + 10, base = bottom - 9;
    page_.lines(std::array{PdfPlace{x, base - 4}, PdfPlace{x, base}, PdfPlace{x + length, base},
                           PdfPlace{x + length, base - 4}},
                {kBlack, 1.2});
    page_.text({x + length + 6, base}, letters(bar.words), 7.5, kBlack);
    const double north = kRight - 16;
    page_.polygon(std::array{PdfPlace{north, top + 8}, PdfPlace{north - 4, top + 20}, PdfPlace{north, top + 17.5},
                             PdfPlace{north + 4, top + 20}},
                  kBlack);
    page_.text({north - 2.9, top + 29}, letters("N", true), 8, kBlack);
  }

  /// Draws what the map's lines and signs mean.
  void key() {
    const double base = y_ + 11;
    double x = kLeft;
    const auto words = [&](const char* text) {
      const PdfText drawn = letters(text);
      page_.text({x, base}, drawn, 7, kBlack);
      x += width_of(drawn, 7) + 10;
    };
    for (const Line one : {Line::Coloured, Line::Colourless, Line::Empty, Line::Driven}) {
      page_.lines(std::array{PdfPlace{x + 1, base - 2.5}, PdfPlace{x + 20, base - 2.5}}, stroke_of(one));
      x += 24;
      words(kLineWords[static_cast<std::size_t>(one)]);
    }
    page_.circle({x + 3.5, base - 2.5}, 3.2, {kWeak, 0.9});
    x += 11;
    words("weak GNSS or pose");
    page_.circle({x + 4.5, base - 2.5}, 4.5, {kBlack, 0.9});
    page_.text({x + 2.7, base - 0.4}, letters("1", true), 6, kBlack);
    x += 13;
    words("place of a remark");
    page_.rectangle({x, base - 6.5}, {x + 13, base + 1.5}, kMark);
    page_.text({x + 2, base - 0.3}, letters("M1", true), 6, kWhite);
    x += 17;
    words("operator's mark");
    y_ += kKey;
  }

  const ReportContent& content_;
  PdfPage page_;
  double y_ = kTop;  // below what is drawn
};

}  // namespace

std::string report_pdf(const ReportContent& content) { return Report(content).file(); }

}  // namespace hueline::runtime
