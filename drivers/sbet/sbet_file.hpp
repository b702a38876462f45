#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/geodesy.hpp"
#include "core/input_file.hpp"
#include "core/result.hpp"

/// SBET and SMRMSG, the files in which programs hand over a trajectory that they have calculated after the drive
/// (Applanix's "smoothed best estimate of trajectory" and its accuracies). Both have no header: records of doubles,
/// little endian.
///
///   SBET, 136 bytes: time (s of the GPS week), latitude, longitude (rad), height above the ellipsoid (m),
///     velocity x, y, z (m/s), roll, pitch, platform heading, wander angle (rad), acceleration and angular rate x, y, z
///   SMRMSG, 80 bytes: time, position north, east, down (m), velocity north, east, down (m/s), each as one sigma,
///     roll, pitch, heading (arc minutes)
///
/// Velocities are not read: POSPac writes them along the wander frame (x and y are turned from north and west by the
/// wander angle), others along the vehicle, and nothing in the file says which. The positions tell the velocity.
namespace hueline::drivers {

/// A record of an SBET.
struct SbetRecord {
  double second = 0;  ///< s of the GPS week; goes on beyond the end of the week
  Geodetic position{};
  double roll = 0, pitch = 0;   ///< rad, as in Attitude
  double platform_heading = 0;  ///< rad, clockwise from the x axis of the wander frame
  double wander = 0;            ///< rad; that axis is turned by it from north, counterclockwise
  /// One sigma, in the order of InsSolution::sigma, if there is an SMRMSG and it has a record within 2 s.
  std::optional<std::array<double, 9>> sigma;
};

/// Reads an SBET from front to back, with the SMRMSG beside it. Thread safety: none.
class SbetFile {
 public:
  struct Counts {
    std::uint64_t records = 0;       ///< given by next()
    std::uint64_t out_of_order = 0;  ///< not later than the one before; left out
    std::uint64_t impossible = 0;    ///< not a place on Earth or not a number; left out
    std::uint64_t bytes_at_end = 0;  ///< of a last record that is not whole
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
