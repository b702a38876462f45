#pragma once

#include <string>
#include <string_view>

#include "core/result.hpp"
#include "storage/pcd_reader.hpp"

/// Reads clouds that are text: PTX and PTS of Leica's programs, and rows of x y z.
namespace hueline::storage {

/// In which coordinates the points of a PTX are wanted.
enum class PtxFrame {
  Scanner,  ///< of the scanner, as they stand in the file
  File,     ///< of the file, to which the matrix of each scan leads
};

/// Returns whether a file that begins so is PTX: the numbers of columns and rows, four lines with the place and the
/// axes of the scanner, and four with a matrix.
bool is_ptx(std::string_view first_bytes);

/// Reads PTX. Columns are x, y, z (NaN where nothing came back: a row of zeros), intensity, and red, green, blue if all
/// scans have them. In the scanner's frame several scans are joined if they have the same matrix. Errors: Malformed
/// with the line; Truncated; Unsupported (scans from different places in the frame of a scanner, more values than
/// kMostCloudValues).
Result<PcdCloud> decode_ptx(std::string_view text, const std::string& name, PtxFrame frame);

/// Returns what kind of rows a text that begins so has, for people: "PTS", "text with x y z"; empty if it is none. PTS
/// has the number of its points in front of them. Other rows must be named by a title with x, y and z, which may be a
/// comment (# or //), or have 3, 4, 6 or 7 numbers: other tables of numbers are as often no points.
std::string text_cloud_kind(std::string_view first_bytes);

/// Reads such rows, whose numbers stand between blanks, commas or semicolons. Without a title, what is behind x y z is
/// the intensity (4 numbers), colours (6, or 7 with the intensity before or behind them, or with an opacity behind them
/// that is 255 throughout) if they are whole numbers from 0 to 255, and else column_4 and so on. These are the names of
/// 7 numbers, too, if all behind x y z could be colours and the file is no PTS: nothing tells the intensity from them.
/// Errors: Malformed with the line; Truncated if a PTS has fewer points than it counts; Unsupported.
Result<PcdCloud> decode_text_cloud(std::string_view text, const std::string& name);

}  // namespace hueline::storage
