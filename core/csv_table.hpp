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

/// The largest table that a command reads, in bytes.
constexpr std::uint64_t kMostTable = 50'000'000;

/// A table that people wrote or exported. The first line names the columns, in any order; each further line is a row.
/// Values are separated by commas, semicolons or tabs; the first line decides which. A value may stand in quotes, which
/// are doubled inside it, but must end in its line. Blanks around values, empty lines, lines that begin with #, a byte
/// order mark and CR LF are allowed. Immutable.
class CsvTable {
 public:
  struct Columns {
    std::vector<std::string> needed, allowed;  ///< columns that must be there, and columns that may be there
    /// Text behind the list of needed columns in the message about an unknown column: "(pixels and metres)".
    std::string units;
    /// Returns what is wrong with the name of a column that is neither needed nor allowed: "column 'x_ft' is not in
    /// metres". If the function is not set or returns nothing, the message calls the column unknown.
    std::function<std::string(std::string_view)> advice;
  };
  /// Parses a table; `file` names it in messages. Errors: Malformed, with file and line, for a column that is unknown,
  /// missing or there twice, for a row with another number of values, for a quoted value that does not end, for UTF-16,
  /// and for a table without a first line or without rows.
  static Result<CsvTable> parse(std::string_view text, const std::string& file, const Columns& columns);

  std::size_t rows() const { return rows_.size(); }
  bool has(const std::string& column) const { return columns_.contains(column); }
  int line(std::size_t row) const { return rows_[row].line; }
  /// Returns the value, or an empty text if the table does not have the column.
  const std::string& text(std::size_t row, const std::string& column) const;
  /// Returns a finite number. Decimals stand behind a point; where commas do not separate values and no value of the
  /// column has a point, behind a comma. Errors, here and in the next two: Malformed, with file, line, column and
  /// value.
  Result<double> number(std::size_t row, const std::string& column) const;
  /// Returns nothing if the column or the value is left out.
  Result<std::optional<double>> optional_number(std::size_t row, const std::string& column) const;
  Result<std::uint32_t> whole_number(std::size_t row, const std::string& column) const;
  /// Returns an Error of kind Malformed with the file, the row's line, and `what` is wrong with it.
  Error refuse(std::size_t row, const std::string& what) const;

 private:
  struct Row {
    int line;
    std::vector<std::string> values;
  };
  std::string file_;
  std::map<std::string, std::size_t> columns_;
  std::vector<Row> rows_;
  char separator_ = ',';
  std::vector<bool> has_point_;  // by column: whether a value of it has a point
};

/// Returns `text` as one value of a table with commas: in quotes if it needs them.
std::string csv_value(const std::string& text);

}  // namespace hueline
