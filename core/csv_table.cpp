#include "core/csv_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/number_word.hpp"

namespace hueline {
namespace {

constexpr std::string_view kBlank = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t from = text.find_first_not_of(kBlank);
  return from == std::string_view::npos ? std::string_view()
                                        : text.substr(from, text.find_last_not_of(kBlank) - from + 1);
}

/// Takes the value in quotes with which `line` begins, and what follows up to the separator. Nothing: it does not end.
std::optional<std::string> take_quoted(std::string_view& line, char separator) {
  std::string value;
  std::size_t at = 1;
  for (; at < line.size(); ++at) {
    if (line[at] != '"') {
      value += line[at];
    } else if (line.substr(at + 1).starts_with('"')) {
      value += line[at++];
    } else {
      break;
    }
  }
  if (at >= line.size()) return std::nullopt;
  const std::size_t end = std::min(line.find(separator, at), line.size());
  if (!trimmed(line.substr(at + 1, end - at - 1)).empty()) return std::nullopt;
  line.remove_prefix(end);
  return value;
}

/// Returns the values of a line. Nothing: a value in quotes does not end.
std::optional<std::vector<std::string>> split(std::string_view line, char separator) {
  std::vector<std::string> out;
  for (;;) {
    std::string_view rest = line;
    while (!rest.empty() && rest.front() != separator && kBlank.find(rest.front()) != std::string_view::npos)
      rest.remove_prefix(1);
    if (rest.starts_with('"')) {
      auto value = take_quoted(rest, separator);
      if (!value) return std::nullopt;
      out.push_back(std::move(*value));
      line = rest;
    } else {
      const std::size_t end = std::min(line.find(separator), line.size());
      out.emplace_back(trimmed(line.substr(0, end)));
      line.remove_prefix(end);
    }
    if (line.empty()) return out;
    line.remove_prefix(1);
  }
}

Error refused(const std::string& file, int line, const std::string& what) {
  return {ErrorCode::Malformed, fmt::format("{}:{}: {}", file, line, what)};
}

bool is_among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string unknown(const std::string& name, const CsvTable::Columns& columns) {
  std::string why = columns.advice ? columns.advice(name) : "";
  if (why.empty()) why = fmt::format("column '{}' is unknown", name);
  why += fmt::format("; allowed: {}", fmt::join(columns.needed, ", "));
  if (!columns.units.empty()) why += " " + columns.units;
  for (const std::string& other : columns.allowed) why += ", " + other;
  return why;
}

}  // namespace

Result<CsvTable> CsvTable::parse(std::string_view text, const std::string& file, const Columns& columns) {
  CsvTable table;
  table.file_ = file;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    return refused(file, 1, "the text is UTF-16; save it as UTF-8");
  int number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
    if (table.columns_.empty()) {
      for (const char separator : {'\t', ',', ';'})
        if (line.find(separator) != std::string_view::npos) table.separator_ = separator;
    }
    auto values = split(line, table.separator_);
    if (!values) return refused(file, number, "a value in quotes does not end, or something stands behind it");
    if (table.columns_.empty()) {
      std::size_t place = 0;
      for (const std::string& name : *values) {
        if (!is_among(columns.needed, name) && !is_among(columns.allowed, name))
          return refused(file, number, unknown(name, columns));
        if (!table.columns_.emplace(name, place++).second)
          return refused(file, number, fmt::format("column '{}' is there twice", name));
      }
      for (const std::string& name : columns.needed)
        if (!table.has(name))
          return refused(file, number,
                         fmt::format("column '{}' is missing; the first line must name {}", name,
                                     fmt::join(columns.needed, ", ")));
      table.has_point_.assign(values->size(), false);
      continue;
    }
    Row row{number, std::move(*values)};
    if (row.values.size() != table.columns_.size())
      return refused(
          file, number,
          fmt::format("{} values, the first line names {} columns", row.values.size(), table.columns_.size()));
    for (std::size_t i = 0; i < row.values.size(); ++i)
      if (row.values[i].find('.') != std::string::npos) table.has_point_[i] = true;
    table.rows_.push_back(std::move(row));
  }
  if (table.columns_.empty())
    return refused(file, std::max(number, 1),
                   fmt::format("no line that names the columns: {}", fmt::join(columns.needed, ", ")));
  if (table.rows_.empty()) return refused(file, number, "holds no rows");
  return table;
}

const std::string& CsvTable::text(std::size_t row, const std::string& column) const {
  static const std::string nothing;
  const auto found = columns_.find(column);
  return found == columns_.end() ? nothing : rows_[row].values[found->second];
}

Result<double> CsvTable::number(std::size_t row, const std::string& column) const {
  const std::string& word = text(row, column);
  double value = 0;
  if (read_number(word, value) && std::isfinite(value)) return value;
  const std::size_t comma = word.find(',');
  if (comma == std::string::npos) return refuse(row, fmt::format("{} is '{}', not a number", column, word));
  if (separator_ != ',' && !has_point_[columns_.at(column)]) {
    std::string pointed = word;
    pointed[comma] = '.';
    if (read_number(pointed, value) && std::isfinite(value)) return value;
  }
  return refuse(row, fmt::format("{} is '{}', not a number; decimals stand behind a point", column, word));
}

Result<std::optional<double>> CsvTable::optional_number(std::size_t row, const std::string& column) const {
  if (text(row, column).empty()) return std::optional<double>();
  const auto value = number(row, column);
  if (!value.ok()) return value.error();
  return std::optional<double>(*value);
}

Result<std::uint32_t> CsvTable::whole_number(std::size_t row, const std::string& column) const {
  const std::string& word = text(row, column);
  std::uint32_t value = 0;
  if (read_number(word, value)) return value;
  return refuse(row, fmt::format("{} is '{}', not a whole number", column, word));
}

std::string csv_value(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

Error CsvTable::refuse(std::size_t row, const std::string& what) const { return refused(file_, rows_[row].line, what); }

}  // namespace hueline
