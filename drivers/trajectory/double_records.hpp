#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "core/result.hpp"

namespace hueline::drivers {

/// Reads a file of records of so many doubles each, little endian, from front to back in blocks. Move-only.
/// Thread safety: none.
class DoubleRecords {
 public:
  DoubleRecords(InputFile file, std::size_t doubles) : file_(std::move(file)), doubles_(doubles) {}
  /// Returns the doubles of the next record; nothing at the end. Error: Io.
  Result<std::optional<std::vector<double>>> next();
  /// Returns the number of bytes of a last record that is not whole.
  std::uint64_t rest() const { return file_.size() % (doubles_ * sizeof(double)); }
  std::string path() const { return file_.path().string(); }

 private:
  InputFile file_;
  std::size_t doubles_, at_ = 0;
  std::uint64_t offset_ = 0;
  std::vector<std::byte> block_;
};

}  // namespace hueline::drivers
