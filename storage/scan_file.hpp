#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "core/result.hpp"

namespace hueline::storage {

/// The file formats of static scans.
enum class ScanFormat { Las, Ply, Pcd, E57, Text, Float32 };
/// Returns the name of the format on the command line: "las", "ply", "pcd", "e57", "xyz" or "float32".
const char* name(ScanFormat format);
std::optional<ScanFormat> scan_format(const std::string& name);

/// What is needed to find the coordinates of point n in the file.
struct ScanLayout {
  enum class Number { Float32, Float64, ScaledInt32 };
  ScanFormat format = ScanFormat::Float32;
  std::string words;  ///< for people, e.g. "PLY 1.0, binary_little_endian, double x y z"
  bool is_text = false;
  std::uint64_t begin = 0;              ///< first byte of the points
  std::optional<std::uint64_t> points;  ///< unknown for text until it is read
  std::size_t record_size = 12;         ///< bytes of a record; not for text
  Number number = Number::Float32;
  bool is_big_endian = false;
  std::array<std::size_t, 3> place{0, 4, 8};       ///< of x, y and z: byte in the record, or column of the text
  std::array<double, 3> scale{1, 1, 1}, offset{};  ///< for ScaledInt32
  bool may_have_title = false;                     ///< text whose first line may name columns or count points
};

/// Reads the coordinates of a static scan of any size block by block. Move-only. Formats:
/// - LAS 1.0-1.4, point formats 0-10
/// - PLY, ascii or binary of either byte order, float or double; vertices must be the first element
/// - PCD, ascii, binary, or binary_compressed, which is held whole in memory
/// - text with x y z in its first columns
/// - float32 x y z without a header, little-endian
/// - E57, of which the places are held in memory, 12 bytes each (read_e57_places())
class ScanFile {
 public:
  /// Opens a scan. Without `format`, LAS, PLY, PCD and E57 are recognised by their first bytes; otherwise the endings
  /// .f32, .raw and .bin mean float32, and .xyz, .txt, .asc and .csv mean text. Errors: Io; Malformed; Truncated if the
  /// file is shorter than its header says; Unsupported, with what to do. `origin` is taken away from each place before
  /// it becomes a float, which in the coordinates of a map alone would have steps of up to 0.5 m.
  static Result<ScanFile> open(const std::filesystem::path& path, std::optional<ScanFormat> format = {},
                               const std::array<double, 3>& origin = {});

  const ScanLayout& layout() const { return layout_; }
  std::uint64_t bytes() const { return file_.size(); }
  /// Returns the number of blocks.
  std::size_t blocks() const { return block_count_; }
  /// Returns x y z of the points of a block as float, from the origin, in the units of the file; valid until `scratch`
  /// changes. What has no place is NaN, or 0 0 0 in files that say it so and have no other origin. Blocks follow each
  /// other in the order of the file. Reentrant if each thread has its own `scratch`.
  Result<std::span<const float>> block(std::size_t index, std::vector<std::byte>& scratch) const;

 private:
  ScanFile(InputFile file, ScanLayout layout, const std::array<double, 3>& origin)
      : file_(std::move(file)), layout_(std::move(layout)), origin_(origin) {}
  void put_place(const std::array<double, 3>& xyz, float* out) const;
  Result<std::span<const float>> records(std::size_t index, std::vector<std::byte>& scratch) const;
  Result<std::span<const float>> lines(std::size_t index, std::vector<std::byte>& scratch) const;

  InputFile file_;
  ScanLayout layout_;
  std::array<double, 3> origin_;
  std::vector<float> whole_;      // points of a compressed PCD or of E57
  std::uint64_t block_size_ = 0;  // points, or bytes of text
  std::size_t block_count_ = 0;
};

/// Returns the layout that the first bytes of a file describe. `file` is also asked for its name and size.
Result<ScanLayout> read_scan_layout(const InputFile& file, std::optional<ScanFormat> format);

}  // namespace hueline::storage
