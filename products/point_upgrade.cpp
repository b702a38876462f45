#include "products/point_upgrade.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include "products/laz_file.hpp"
#include "storage/cloud_crs.hpp"

namespace hueline::products {

using storage::ByteView;
using storage::LasVlr;

Result<PointUpgrade> PointUpgrade::create(const storage::LasReader& cloud) {
  PointUpgrade out;
  out.header_ = cloud.header();
  out.records_ = lasting_records(cloud.records());
  out.old_format_ = out.header_.point_format;
  if (out.old_format_ == 4 || out.old_format_ == 5 || out.old_format_ > 8)
    return Error{ErrorCode::Invalid, "points of format " + std::to_string(out.old_format_) +
                                         " have waveforms, and COPC has none (its formats are 6 to 8)"};
  const auto is_wkt = [](const LasVlr& record) {
    return record.user_id == "LASF_Projection" && record.record_id == 2112;
  };
  const Result<std::string> wkt = storage::crs_wkt(cloud);
  if (!wkt) return wkt.error();
  if (std::ranges::none_of(out.records_, is_wkt) && !wkt->empty()) {
    std::erase_if(out.records_, [](const LasVlr& record) {
      return record.user_id == "LASF_Projection" && record.record_id >= 34735 && record.record_id <= 34737;
    });
    out.records_.push_back({"LASF_Projection", 2112, "OGC WKT", *wkt + '\0'});
  }
  if (out.old_format_ >= 6 && std::ranges::none_of(out.records_, is_wkt)) return out;
  out.header_.global_encoding |= storage::kLasWkt;
  if (out.old_format_ >= 6) return out;

  const std::size_t before = storage::las_point_size(out.old_format_);
  out.header_.point_format = out.old_format_ >= 2 ? 7 : 6;
  out.header_.point_size =
      static_cast<std::uint16_t>(out.header_.point_size - before + storage::las_point_size(out.header_.point_format));
  return out;
}

ByteView PointUpgrade::operator()(ByteView record) {
  if (old_format_ >= 6) return record;
  const auto byte = [&](std::size_t at) { return std::to_integer<unsigned>(record[at]); };
  record_.assign(header_.point_size, std::byte{0});
  const auto take = [&](std::size_t from, std::size_t to, std::size_t size) {
    std::memcpy(&record_[to], &record[from], size);
  };
  take(0, 0, 14);  // place and intensity
  const unsigned returns = byte(14), classes = byte(15);
  const bool is_overlap = (classes & 31) == 12;
  storage::put(record_, 14, static_cast<std::uint8_t>((returns & 7) | (returns >> 3 & 7) << 4));
  // Synthetic, key point and withheld have the same order; direction of the scan and edge of the line stand on top.
  storage::put(record_, 15, static_cast<std::uint8_t>(classes >> 5 | (is_overlap ? 8u : 0u) | (returns & 0xC0)));
  storage::put(record_, 16, static_cast<std::uint8_t>(is_overlap ? 1 : classes & 31));
  take(17, 17, 1);
  std::int8_t degrees = 0;
  std::memcpy(&degrees, &record[16], 1);
  storage::put(record_, 18, static_cast<std::int16_t>(std::lround(degrees / 0.006)));
  take(18, 20, 2);
  const std::size_t time = old_format_ & 1 ? 8 : 0;
  if (time != 0) take(20, 22, time);
  if (old_format_ >= 2) take(20 + time, 30, 6);
  const std::size_t before = storage::las_point_size(old_format_), extra = record.size() - before;
  if (extra != 0) take(before, storage::las_point_size(header_.point_format), extra);
  return record_;
}

}  // namespace hueline::products
