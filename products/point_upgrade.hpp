#pragma once

#include <vector>

#include "core/result.hpp"
#include "storage/las_reader.hpp"

namespace hueline::products {

/// Gives points of the formats 0 to 3 the formats 6 and 7 of LAS 1.4, which COPC asks for; points that have one of the
/// formats 6 to 8 stay as they are. Nothing is lost: a scan angle in whole degrees becomes one in steps of 0.006 deg, a
/// class of 12 (overlap) the flag that LAS 1.4 has for it, with class 1; without a time, the time is 0. Source: LAS 1.4
/// R15, tables 7 to 16. Thread safety: none.
class PointUpgrade {
 public:
  /// Errors: Invalid for a format that COPC has nothing for (4, 5, 9 and 10: waveforms); those of crs_wkt().
  static Result<PointUpgrade> create(const storage::LasReader& cloud);

  /// The header and the records that describe the points after it. A CRS in GeoTIFF keys is WKT here.
  const storage::LasHeader& header() const { return header_; }
  const std::vector<storage::LasVlr>& records() const { return records_; }
  /// Returns the record of a point; valid until the next call.
  storage::ByteView operator()(storage::ByteView record);

 private:
  PointUpgrade() = default;
  storage::LasHeader header_;
  std::vector<storage::LasVlr> records_;
  int old_format_ = 7;
  storage::Bytes record_;
};

}  // namespace hueline::products
