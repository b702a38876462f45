#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/result.hpp"
#include "drivers/trajectory/double_records.hpp"
#include "drivers/trajectory/sbet_record.hpp"
#include "drivers/trajectory/smrmsg_file.hpp"

namespace hueline::drivers {

/// Reads an SBET (sbet_record.hpp) from front to back, with the SMRMSG (smrmsg_file.hpp) beside it. Thread safety:
/// none.
class SbetFile {
 public:
  struct Counts {
    std::uint64_t records = 0;       ///< given by next()
    std::uint64_t out_of_order = 0;  ///< not later than the one before; left out
    std::uint64_t impossible = 0;    ///< not a place on Earth or not a number; left out
    std::uint64_t bytes_at_end = 0;  ///< of a last record that is not whole
    /// Of the SMRMSG, as far as it was read: records that are possible, others, and bytes as above.
    std::uint64_t accuracies = 0, impossible_accuracies = 0, accuracy_bytes_at_end = 0;
  };

  /// Opens an SBET and, unless its path is empty, an SMRMSG. Errors: those of InputFile; Malformed if the first record
  /// is none of such a file.
  static Result<SbetFile> open(const std::string& sbet, const std::string& smrmsg);

  /// Returns the next record, in order of time. Errors: EndOfData; Io.
  Result<SbetRecord> next();
  const Counts& counts() const { return counts_; }

 private:
  explicit SbetFile(DoubleRecords poses) : poses_(std::move(poses)) {}
  Status read_accuracy();
  Status take_accuracy(SbetRecord& record);

  DoubleRecords poses_;
  std::optional<SmrmsgFile> accuracies_;
  std::optional<SmrmsgFile::Record> before_, after_;  // the records of the SMRMSG around the last record
  std::optional<double> last_second_;
  Counts counts_;
};

}  // namespace hueline::drivers
