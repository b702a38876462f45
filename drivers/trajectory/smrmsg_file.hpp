#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "core/result.hpp"
#include "drivers/trajectory/double_records.hpp"

/// SMRMSG, the accuracies of a trajectory, as Applanix's programs write them beside an SBET (sbet_record.hpp): records
/// of 10 doubles, little endian.
///
///   time (s of the GPS week), position north, east, down (m), velocity north, east, down (m/s), each as one sigma,
///   roll, pitch, heading (arc minutes)
namespace hueline::drivers {

/// Reads an SMRMSG from front to back. Move-only. Thread safety: none.
class SmrmsgFile {
 public:
  struct Record {
    double second = 0;              ///< of the GPS week; may go on beyond the end of the week
    std::array<double, 9> sigma{};  ///< in the order of InsSolution::sigma: east, north, up, velocities, angles (rad)
  };

  /// Opens the file. Errors: those of InputFile; Malformed if its first record is none of an SMRMSG.
  static Result<SmrmsgFile> open(const std::string& path);

  /// Returns the next record that is possible; nothing at the end. Error: Io.
  Result<std::optional<Record>> next();
  std::uint64_t records() const { return count_; }  ///< that next() has given
  std::uint64_t impossible() const { return impossible_; }
  std::uint64_t bytes_at_end() const { return records_.rest(); }  ///< of a last record that is not whole

 private:
  explicit SmrmsgFile(DoubleRecords records) : records_(std::move(records)) {}
  Result<std::optional<Record>> read();

  DoubleRecords records_;
  std::optional<Record> first_;  // read by open()
  std::optional<double> last_second_;
  std::uint64_t count_ = 0, impossible_ = 0;
};

/// Returns whether a file may be an SMRMSG: by the first two records, whose times follow each other within a minute and
/// whose sigmas are small and positive. Nothing else marks one.
bool is_smrmsg(std::span<const std::byte> first_bytes);

}  // namespace hueline::drivers
