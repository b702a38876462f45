#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace hueline {

/// The longest table that a command reads, bytes: people make them by hand or export them.
constexpr std::uint64_t kMostTable = 50'000'000;

/// A table as people hand it over: a line that names the columns in any order, then a row a line. Commas or semicolons
/// between values, whichever the first line has; blanks around values, empty lines, lines that begin with #, a byte
/// order mark and CR LF do not matter. Quotes are not read. Immutable.
class CsvTable {
 public:
  struct Columns {
    std::vector<std::string> needed, allowed;  ///< must be there; may be
    std::string units;  ///< behind the needed ones where a column is unknown, as "(pixels and metres)"
    /// What is wrong with the name of a column that is neither, as "column 'x_ft' is not in metres". Without it, or
    /// empty: it is unknown.
    std::function<std::string(std::string_view)> advice;
  };
  /// `file` stands for the file in messages. Errors: Malformed, with file and line: a column that is unknown, missing,
  /// or there twice; a row with another number of values; quotes; no first line, no row.
  static Result<CsvTable> parse(std::string_view text, const std::string& file, const Columns& columns);

  std::size_t rows() const { return rows_.size(); }
  bool has(const std::string& column) const { return columns_.contains(column); }
  int line(std::size_t row) const { return rows_[row].line; }
  /// Empty where the column is not there.
  const std::string& text(std::size_t row, const std::string& column) const;
  /// Errors of the three: Malformed, with file, line, column and value; a finite number with a decimal point.
  Result<double> number(std::size_t row, const std::string& column) const;
  Result<std::optional<double>> optional_number(std::size_t row,
                                                const std::string& column) const;  ///< column or value may be left out
  Result<std::uint32_t> whole_number(std::size_t row, const std::string& column) const;
  /// Malformed: the file and the row's line, then what is wrong with it.
  Error refuse(std::size_t row, const std::string& what) const;

 private:
  struct Row {
    int line;
    std::vector<std::string> values;
  };
  std::string file_;
  std::map<std::string, std::size_t> columns_;
  std::vector<Row> rows_;
};

}  // namespace hueline
