#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "core/result.hpp"
#include "drivers/trajectory/sbet_record.hpp"

/// SBET (sbet_record.hpp) with SMRMSG, the file of its accuracies: records of 10 doubles, little endian.
///
///   time (s of the GPS week), position north, east, down (m), velocity north, east, down (m/s), each as one sigma,
///   roll, pitch, heading (arc minutes)
namespace hueline::drivers {

/// Reads an SBET from front to back, with the SMRMSG beside it. Thread safety: none.
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
  /// Records of equal size, read in blocks.
  class Records {
   public:
    Records(InputFile file, std::size_t doubles) : file_(std::move(file)), doubles_(doubles) {}
    /// Returns the doubles of the next record; nothing at the end.
    Result<std::optional<std::vector<double>>> next();
    std::uint64_t rest() const { return file_.size() % (doubles_ * sizeof(double)); }
    std::string path() const { return file_.path().string(); }

   private:
    InputFile file_;
    std::size_t doubles_, at_ = 0;
    std::uint64_t offset_ = 0;
    std::vector<std::byte> block_;
  };
  struct Accuracy {
    double second = 0;
    std::array<double, 9> sigma{};
  };
  explicit SbetFile(Records poses) : poses_(std::move(poses)) {}
  Status read_accuracy();
  Status take_accuracy(SbetRecord& record);

  Records poses_;
  std::optional<Records> accuracies_;
  std::optional<Accuracy> before_, after_;  // the records of the SMRMSG around the last record
  std::optional<double> last_second_, last_accuracy_;
  Counts counts_;
};

}  // namespace hueline::drivers
