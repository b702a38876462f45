#include "core/csv_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace hueline {
namespace {

constexpr std::string_view kBlank = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t from = text.find_first_not_of(kBlank);
  return from == std::string_view::npos ? std::string_view()
                                        : text.substr(from, text.find_last_not_of(kBlank) - from + 1);
}

std::vector<std::string> split(std::string_view line, char separator) {
  std::vector<std::string> out;
  for (;;) {
    const std::size_t end = line.find(separator);
    out.emplace_back(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return out;
    line.remove_prefix(end + 1);
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

template <class T>
bool reads(const std::string& word, T& value) {
  const auto [end, wrong] = std::from_chars(word.data(), word.data() + word.size(), value);
  return wrong == std::errc() && end == word.data() + word.size();
}

}  // namespace

Result<CsvTable> CsvTable::parse(std::string_view text, const std::string& file, const Columns& columns) {
  CsvTable table;
  table.file_ = file;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  char separator = ',';
  int number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    if (line.empty() || line.front() == '#') continue;
    if (line.find('"') != std::string_view::npos)
      return refused(file, number, "quoted values are not read; leave the quotes out");
    if (table.columns_.empty()) {
      if (line.find(';') != std::string_view::npos) separator = ';';
      std::size_t place = 0;
      for (const std::string& name : split(line, separator)) {
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
      continue;
    }
    Row row{number, split(line, separator)};
    if (row.values.size() != table.columns_.size())
      return refused(
          file, number,
          fmt::format("{} values, the first line names {} columns", row.values.size(), table.columns_.size()));
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
  if (reads(word, value) && std::isfinite(value)) return value;
  return refuse(row, fmt::format("{} is '{}', not a number{}", column, word,
                                 word.find(',') == std::string::npos ? "" : "; decimals stand behind a point"));
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
  if (reads(word, value)) return value;
  return refuse(row, fmt::format("{} is '{}', not a whole number", column, word));
}

Error CsvTable::refuse(std::size_t row, const std::string& what) const { return refused(file_, rows_[row].line, what); }

}  // namespace hueline
