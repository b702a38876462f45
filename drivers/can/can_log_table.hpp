#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "drivers/can/can_log_entry.hpp"

namespace hueline::drivers {

/// Reads logs of CAN buses whose first lines say what their columns are: the tables (CSV) of SavvyCAN, which GVRET
/// adapters fill, and of python-can, and the logs of BUSMASTER. What it knows about them comes from logs and from what
/// these programs write.
/// Times: SavvyCAN counts microseconds of the adapter, which start again after 2^32 if it has 32 bits; python-can has
/// seconds since 1970; BUSMASTER has the time of day or since its beginning, and goes on behind midnight.
/// Thread safety: none; one thread reads one log.
class CanLogTable {
 public:
  /// Returns whether the line begins such a log, or is a further line of its head; its columns are then known. Call it
  /// for each line before `take`.
  bool take_head(std::string_view line);
  /// Returns whether `line`, the first of a file, begins such a log.
  static bool is_head(std::string_view line) { return CanLogTable().take_head(line); }
  bool is_begun() const { return kind_ != Kind::None; }
  /// Reads a row. Error: Malformed.
  Result<std::optional<CanLogEntry>> take(std::string_view line);

 private:
  enum class Kind : std::uint8_t { None, Csv, Busmaster };
  enum class Column : std::uint8_t { Other, Time, Id, Extended, Remote, Broken, Direction, Bus, Length, Byte, Base64 };

  bool take_names(std::string_view line);
  Result<std::optional<CanLogEntry>> take_row(std::string_view line);
  Result<std::optional<CanLogEntry>> take_busmaster(std::string_view line);
  nanoseconds going_on(nanoseconds time, nanoseconds turn);

  Kind kind_ = Kind::None;
  std::vector<Column> columns_;
  bool is_hex_ = true, is_relative_ = false, is_can_ = true;
  nanoseconds last_{0};   ///< as the latest row has it
  nanoseconds turns_{0};  ///< what has been added because the clock of the log started again
};

}  // namespace hueline::drivers
