#include "storage/text_cloud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/line_words.hpp"
#include "core/number_word.hpp"

namespace hueline::storage {
namespace {

constexpr const char* kRowBlanks = " \t\r,;";
constexpr std::size_t kMostRow = 64 * 1024;  // bytes; a longer line is no row

/// The lines of a text, one after another, without those that are empty.
class TextLines {
 public:
  explicit TextLines(std::string_view text) : text_(text) {}
  /// Returns the words of the next line; nothing at the end. A line that is too long for a row is one word.
  std::optional<std::vector<std::string_view>> next() {
    while (at_ < text_.size()) {
      const std::size_t end = std::min(text_.find('\n', at_), text_.size());
      line_ = text_.substr(at_, end - at_);
      at_ = end + 1;
      ++number_;
      auto words = line_.size() > kMostRow ? std::vector{line_} : line_words(line_, kRowBlanks);
      if (!words.empty()) return words;
    }
    return {};
  }
  std::size_t number() const { return number_; }
  std::string_view line() const { return line_; }
  /// Returns whether the last line ended with the text and not with a line end, so that it may have been cut.
  bool may_be_cut() const { return at_ > text_.size(); }

 private:
  std::string_view text_, line_;
  std::size_t at_ = 0, number_ = 0;
};

/// Reads a row of numbers into `out`. Returns false if a word is none.
bool read_row(const std::vector<std::string_view>& words, std::vector<double>& out) {
  out.resize(words.size());
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::string_view word = words[i];
    if (word.starts_with('+')) word.remove_prefix(1);
    if (!read_number(word, out[i])) return false;
  }
  return true;
}

std::optional<std::uint64_t> lone_count(const std::vector<std::string_view>& words) {
  return words.size() == 1 ? parse_number<std::uint64_t>(words.front()) : std::nullopt;
}

Error wrong_line(const std::string& name, const TextLines& lines, const char* what) {
  return {ErrorCode::Malformed,
          fmt::format("{}: line {}: '{}' {}", name, lines.number(), lines.line().substr(0, 60), what)};
}

/// Returns the names of a title, if it has x, y and z; these in small letters. Names between commas may have blanks.
std::vector<std::string> names_in(std::string_view line) {
  if (line.size() > kMostRow) return {};
  line.remove_prefix(std::min(line.find_first_not_of(" \t#/"), line.size()));
  const bool has_commas = line.find_first_of(",;") != std::string_view::npos;
  std::vector<std::string> out;
  std::size_t axes = 0;
  for (std::string_view word : line_words(line, has_commas ? "\r,;" : " \t\r")) {
    const std::size_t begin = word.find_first_not_of(" \t\"");
    if (begin == std::string_view::npos) continue;
    std::string field(word.substr(begin, word.find_last_not_of(" \t\"") + 1 - begin));
    if (field == "FIELDS") return {};  // of a PCD
    if (field.size() == 1 && std::string_view("XYZ").find(field[0]) != std::string_view::npos)
      field[0] = static_cast<char>(field[0] - 'X' + 'x');
    axes += field == "x" || field == "y" || field == "z";
    out.push_back(std::move(field));
  }
  return axes == 3 ? out : std::vector<std::string>();
}

bool is_comment_word(std::string_view word) { return word.starts_with('#') || word.starts_with("//"); }

/// What the first lines say of the rows.
struct RowForm {
  std::vector<std::string> names;  // empty: there is no title
  bool has_counts = false;         // PTS
  std::size_t columns = 0;
};

std::optional<RowForm> row_form(std::string_view text) {
  constexpr std::size_t kMostBefore = 100;  // lines that are no rows
  RowForm out;
  TextLines lines(text);
  std::vector<double> row;
  while (lines.number() < kMostBefore) {
    const auto words = lines.next();
    if (!words) return {};
    if (is_comment_word(words->front())) {
      if (auto names = names_in(lines.line()); !names.empty()) out.names = std::move(names);
    } else if (!read_row(*words, row)) {
      if (!out.names.empty() || (out.names = names_in(lines.line())).empty()) return {};
    } else if (words->size() == 1 && lone_count(*words) && !out.has_counts) {
      out.has_counts = true;
    } else {
      // A line that the first bytes have not whole says nothing.
      if (lines.may_be_cut()) return {};
      out.columns = row.size();
      if (out.names.size() != out.columns) out.names.clear();
      const bool is_usual = out.columns == 3 || out.columns == 4 || out.columns == 6 || out.columns == 7;
      return is_usual || !out.names.empty() ? std::optional(std::move(out)) : std::nullopt;
    }
  }
  return {};
}

bool are_colours(const std::vector<std::vector<double>>& columns, std::size_t first) {
  for (std::size_t i = first; i < first + 3; ++i)
    if (!std::ranges::all_of(columns[i], [](double v) { return v >= 0 && v <= 255 && v == std::floor(v); }))
      return false;
  return true;
}

/// Names the columns of rows without a title, by their number and their values. Of 7 columns, a PTS has the intensity
/// in front of the colours. In other text it stands there, too, or behind them, as CloudCompare writes it: the values
/// tell which three are colours, or nothing does.
void name_rows(PcdCloud& cloud, bool is_pts) {
  const std::size_t columns = cloud.columns.size();
  cloud.fields = {"x", "y", "z"};
  const auto add = [&](const std::vector<std::string>& fields) {
    cloud.fields.insert(cloud.fields.end(), fields.begin(), fields.end());
  };
  const bool has_colours_at_once = columns >= 6 && are_colours(cloud.columns, 3);
  const bool has_colours_behind = columns == 7 && are_colours(cloud.columns, 4);
  // An opacity is full throughout, which no intensity is.
  const bool has_alpha = has_colours_at_once && has_colours_behind && !is_pts &&
                         std::ranges::all_of(cloud.columns[6], [](double v) { return v == 255; });
  if (has_alpha) {
    add({"red", "green", "blue", "alpha"});
  } else if (has_colours_behind && (is_pts || !has_colours_at_once)) {
    add({"intensity", "red", "green", "blue"});
  } else if (has_colours_at_once && !has_colours_behind) {
    add({"red", "green", "blue"});
    if (columns == 7) add({"intensity"});
  } else if (columns == 4) {
    add({"intensity"});
  }
  while (cloud.fields.size() < columns) cloud.fields.push_back(fmt::format("column_{}", cloud.fields.size() + 1));
}

void set_types(PcdCloud& cloud) {
  cloud.types.assign(cloud.fields.size(), {'F', 8});
  for (std::size_t i = 0; i < cloud.fields.size(); ++i)
    if (cloud.fields[i] == "red" || cloud.fields[i] == "green" || cloud.fields[i] == "blue")
      cloud.types[i] =
          std::ranges::all_of(cloud.columns[i], [](double v) { return v >= 0 && v <= 255 && v == std::floor(v); })
              ? PcdType{'U', 1}
              : PcdType{'F', 8};
}

/// The head of a scan in PTX.
struct PtxHead {
  std::uint64_t points = 0;
  std::array<double, 16> matrix{};  // row by row; a point is a row that stands before it
};

/// Reads the head of a scan behind its first line, `columns`. Returns false if the lines are none.
bool read_ptx_head(TextLines& lines, const std::vector<std::string_view>& first, PtxHead& out) {
  std::vector<std::string_view> words = first;
  const auto columns = lone_count(words);
  auto next = lines.next();
  const auto rows = next ? lone_count(*next) : std::nullopt;
  constexpr std::uint64_t kMostOnASide = 1u << 24;
  if (!columns || !rows || *columns > kMostOnASide || *rows > kMostOnASide) return false;
  out.points = *columns * *rows;
  std::vector<double> row;
  for (std::size_t i = 0; i < 8; ++i) {
    next = lines.next();
    const std::size_t wanted = i < 4 ? 3 : 4;  // place and axes of the scanner, then the matrix
    if (!next || next->size() != wanted || !read_row(*next, row)) return false;
    if (i >= 4) std::ranges::copy(row, out.matrix.begin() + static_cast<std::ptrdiff_t>(4 * (i - 4)));
  }
  return true;
}

}  // namespace

bool is_ptx(std::string_view first_bytes) {
  TextLines lines(first_bytes);
  const auto first = lines.next();
  PtxHead head;
  return first && read_ptx_head(lines, *first, head);
}

Result<PcdCloud> decode_ptx(std::string_view text, const std::string& name, PtxFrame frame) {
  PcdCloud cloud;
  cloud.fields = {"x", "y", "z", "intensity", "red", "green", "blue"};
  cloud.columns.resize(cloud.fields.size());
  TextLines lines(text);
  std::optional<PtxHead> first_head;
  bool all_have_colours = true;
  std::vector<double> row;
  for (auto begin = lines.next(); begin; begin = lines.next()) {
    PtxHead head;
    if (!read_ptx_head(lines, *begin, head)) return wrong_line(name, lines, "is not in place in the head of a scan");
    if (frame == PtxFrame::Scanner && first_head && first_head->matrix != head.matrix)
      return Error{ErrorCode::Unsupported,
                   name +
                       ": its scans were taken from different places, and each is in its scanner's frame: write the "
                       "scan that is meant into a file of its own"};
    if (!first_head) first_head = head;
    const std::array<double, 16>& m = head.matrix;
    for (std::uint64_t i = 0; i < head.points; ++i) {
      const auto words = lines.next();
      if (!words)
        return Error{ErrorCode::Truncated,
                     fmt::format("{}: ends behind {} of the {} points of a scan", name, i, head.points)};
      if ((words->size() != 4 && words->size() != 7) || !read_row(*words, row))
        return wrong_line(name, lines, "is no x y z intensity, with or without red green blue");
      if (cloud.points() > kMostCloudValues / cloud.fields.size()) return too_many_cloud_values(name);
      std::array<double, 3> at{row[0], row[1], row[2]};
      if (at == std::array<double, 3>{}) {
        at.fill(std::numeric_limits<double>::quiet_NaN());
      } else if (frame == PtxFrame::File) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          at[axis] = row[0] * m[axis] + row[1] * m[4 + axis] + row[2] * m[8 + axis] + m[12 + axis];
      }
      for (std::size_t axis = 0; axis < 3; ++axis) cloud.columns[axis].push_back(at[axis]);
      all_have_colours = all_have_colours && row.size() == 7;
      row.resize(7);
      for (std::size_t k = 3; k < 7; ++k) cloud.columns[k].push_back(row[k]);
    }
  }
  if (!all_have_colours) {
    cloud.fields.resize(4);
    cloud.columns.resize(4);
  }
  set_types(cloud);
  return cloud;
}

std::string text_cloud_kind(std::string_view first_bytes) {
  const auto form = row_form(first_bytes);
  return !form ? "" : form->has_counts ? "PTS" : "text with x y z";
}

Result<PcdCloud> decode_text_cloud(std::string_view text, const std::string& name) {
  const auto form = row_form(text);
  if (!form) return Error{ErrorCode::Malformed, name + ": has no rows of x y z"};
  PcdCloud cloud;
  cloud.columns.resize(form->columns);
  TextLines lines(text);
  std::vector<double> row;
  std::optional<std::uint64_t> left;  // of the rows that a PTS counts
  bool has_begun = false;
  while (const auto words = lines.next()) {
    if (is_comment_word(words->front())) continue;
    if (form->has_counts && words->size() == 1 && left.value_or(0) == 0 && (left = lone_count(*words))) continue;
    if (words->size() != form->columns || !read_row(*words, row)) {
      if (!has_begun) continue;  // the title
      return wrong_line(name, lines, fmt::format("is no row of {} numbers", form->columns).c_str());
    }
    if (form->has_counts && left.value_or(0) == 0) return wrong_line(name, lines, "is behind the last point");
    if (left) --*left;
    has_begun = true;
    if (cloud.points() > kMostCloudValues / form->columns) return too_many_cloud_values(name);
    for (std::size_t i = 0; i < row.size(); ++i) cloud.columns[i].push_back(row[i]);
  }
  if (left.value_or(0) > 0)
    return Error{ErrorCode::Truncated, fmt::format("{}: ends behind {} of the {} points that it counts", name,
                                                   cloud.points(), cloud.points() + *left)};
  if (form->names.empty())
    name_rows(cloud, form->has_counts);
  else
    cloud.fields = form->names;
  set_types(cloud);
  return cloud;
}

}  // namespace hueline::storage
