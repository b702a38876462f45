#include "products/image_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <system_error>
#include <utility>

#include "core/calendar.hpp"
#include "core/output_file.hpp"
#include "core/portable_math.hpp"
#include "fusion/lens_exposure.hpp"
#include "products/place_sigma.hpp"
#include "products/recorded_jpeg.hpp"
#include "storage/las_writer.hpp"
#include "storage/photo_file.hpp"

namespace hueline::products {
namespace {

/// Returns names that differ and hold nothing that tables or file systems treat in a special way.
std::vector<std::string> plain_names(const std::vector<fusion::LensMount>& lenses) {
  std::vector<std::string> out;
  std::set<std::string> used;
  for (const fusion::LensMount& lens : lenses) {
    std::string name;
    for (const char c : lens.name) {
      const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                            c == '_' || (c == '.' && !name.empty());
      name += is_plain ? c : '_';
    }
    const std::string wanted = name.empty() ? "lens" : name;
    name = wanted;
    for (int n = 2; !used.insert(name).second; ++n) name = fmt::format("{}_{}", wanted, n);
    out.push_back(name);
  }
  return out;
}

bool overlaps(const PixelRegion& lost, const fusion::LensMount& lens) {
  return lost.x < lens.x_offset + lens.intrinsics.width && lens.x_offset < lost.x + lost.width &&
         lost.y < lens.y_offset + lens.intrinsics.height && lens.y_offset < lost.y + lost.height;
}

}  // namespace

ImageExport::ImageExport(const std::filesystem::path& folder, const fusion::CameraHeadGeometry& head,
                         const storage::MapConfig& map, const Config& config)
    : folder_(folder),
      head_(head),
      map_(map),
      config_(config),
      pool_(config.threads),
      sample_(config.most_points),
      seen_points_({}) {
  const std::vector<std::string> names = plain_names(head.lenses);
  for (std::size_t i = 0; i < head.lenses.size(); ++i) {
    pictures_.emplace_back(head.lenses[i], config.pixels);
    lenses_.push_back({names[i], pictures_.back().intrinsics(), head.lenses[i].row_time});
  }
}

/// Returns whether an image of the camera can be the picture of a lens as it is.
bool ImageExport::copies_jpeg(SensorId camera) const {
  if (config_.is_png || config_.pixels != LensPixels::Recorded) return false;
  const auto is_of = [&](const fusion::LensMount& lens) { return lens.camera == camera; };
  const auto lens = std::find_if(head_.lenses.begin(), head_.lenses.end(), is_of);
  return lens != head_.lenses.end() && lens->x_offset == 0 && lens->y_offset == 0 &&
         std::count_if(head_.lenses.begin(), head_.lenses.end(), is_of) == 1;
}

void ImageExport::add(const Packet& packet) {
  constexpr std::size_t kMostHeld = std::size_t{512} << 20;  // bytes
  if (packet.kind != PacketKind::Wire || packet.shed || !copies_jpeg(packet.sensor) ||
      !may_hold_jpeg(packet.bytes.bytes()))
    return;
  packets_.push_back({packet.sensor, packet.sequence, packet.bytes});
  packet_bytes_ += packet.bytes.size();
  while (packet_bytes_ > kMostHeld && packets_.size() > 1) {
    packet_bytes_ -= packets_.front().bytes.size();
    packets_.pop_front();
  }
}

void ImageExport::add(const Exposure& exposure) {
  ++counts_.exposures;
  if (exposure.timing == ExposureTiming::Unmatched) {
    ++counts_.without_time;
    return;
  }
  if (!exposure.image.is_complete || !fusion::view_of(exposure.image).data) {
    ++counts_.incomplete;
    return;
  }
  waiting_bytes_ += exposure.image.buffer.size();
  Buffer jpeg;
  std::erase_if(packets_, [&](const HeldPacket& held) {
    if (held.sensor != exposure.image.sensor || held.sequence > exposure.image.packet_sequence) return false;
    if (held.sequence == exposure.image.packet_sequence) jpeg = held.bytes;
    packet_bytes_ -= held.bytes.size();
    return true;
  });
  waiting_.push_back({exposure, std::move(jpeg)});
  while (waiting_bytes_ > config_.most_waiting_bytes && waiting_.size() > 1) {
    ++counts_.early;
    waiting_bytes_ -= waiting_.front().exposure.image.buffer.size();
    waiting_.pop_front();
  }
}

Status ImageExport::settle(const Exposure& exposure, const fusion::Trajectory& trajectory) {
  const auto at = std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& one) {
    return one.exposure.camera == exposure.camera && one.exposure.index == exposure.index;
  });
  if (at == waiting_.end()) return status_;
  const Waiting one = std::move(*at);
  waiting_.erase(at);
  waiting_bytes_ -= one.exposure.image.buffer.size();
  const auto pose = trajectory.pose_at(exposure.exposure_mid).pose;
  if (!pose || !origin_) {
    ++counts_.without_pose;
    return status_;
  }
  if (status_ && tables_.empty()) status_ = open_tables(exposure.exposure_mid);
  if (status_) status_ = write(one.exposure, one.jpeg, *pose, trajectory);
  return status_;
}

Status ImageExport::open_tables(GpsTime first) {
  const PictureSet set{folder_, lenses_, *origin_, map_, storage::decimal_year(to_utc(first))};
  for (const auto make : {make_colmap_table, make_nerfstudio_table, make_pose_table}) {
    auto table = make(set);
    if (table)
      tables_.push_back(std::move(*table));
    else if (table.error().code == ErrorCode::Unsupported)
      missing_tables_.push_back(table.error().message);
    else
      return table.error();
  }
  for (const PictureLens& lens : lenses_) {
    std::error_code error;
    const std::filesystem::path folder = folder_ / "images" / lens.name;
    std::filesystem::create_directories(folder, error);
    if (error) return output_error("make the folder " + folder.string(), error.value());
  }
  return {};
}

Status ImageExport::write(const Exposure& exposure, const Buffer& jpeg, const fusion::Pose& middle,
                          const fusion::Trajectory& trajectory) {
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < head_.lenses.size(); ++i) {
    if (head_.lenses[i].camera != exposure.camera) continue;
    const auto& lost = exposure.image.lost;
    if (std::any_of(lost.begin(), lost.end(), [&](const auto& part) { return overlaps(part, head_.lenses[i]); }))
      ++counts_.lost_lenses;
    else
      chosen.push_back(i);
  }
  std::vector<TakenPicture> taken(chosen.size());
  std::vector<Result<storage::Bytes>> files(chosen.size(), Result<storage::Bytes>(Error{}));
  std::vector<std::uint8_t> is_copied(chosen.size(), 0);
  const fusion::RawView view = fusion::view_of(exposure.image);
  const Transform<Ecef, Enu> T_ecef_enu = ecef_from_enu(*origin_);
  // A lens that is exposed longer than others was elsewhere in its own middle.
  std::vector<fusion::Pose> poses;
  for (std::size_t n = 0; n < chosen.size(); ++n) {
    taken[n].time = exposure.exposure_mid + fusion::lateness_of(exposure, head_.lenses[chosen[n]]);
    poses.push_back(trajectory.pose_at(taken[n].time).pose.value_or(middle));
  }
  pool_.run(chosen.size(), [&](std::size_t n) {
    const std::size_t lens = chosen[n];
    const fusion::Pose& pose = poses[n];
    const auto& shown = lenses_[lens].intrinsics;
    TakenPicture& picture = taken[n];
    picture.file =
        fmt::format("images/{}/{:06}.{}", lenses_[lens].name, exposure.index, config_.is_png ? "png" : "jpg");
    picture.lens = lens;
    picture.exposure = exposure.index;
    picture.sigma_time = exposure.sigma;
    picture.T_enu_lens = pose.T_enu_body * head_.T_body_head * head_.lenses[lens].T_head_lens;
    picture.sigma_position = place_sigma(pose, picture.T_enu_lens.translation - pose.T_enu_body.translation);
    picture.sigma_attitude = pose.sigma_attitude;

    if (view.width == shown.width && view.height == shown.height)
      if (storage::Bytes recorded = recorded_jpeg(jpeg.bytes(), shown.width, shown.height); !recorded.empty()) {
        files[n] = std::move(recorded);
        is_copied[n] = 1;
        return;
      }
    const Point<Ecef> place = T_ecef_enu * Point<Enu>{picture.T_enu_lens.translation};
    storage::PhotoTags tags;
    tags.software = config_.software;
    tags.description =
        fmt::format("exposure {} of {}; altitude above the WGS84 ellipsoid", exposure.index, lenses_[lens].name);
    tags.taken = to_utc(picture.time);
    tags.exposure_s = to_seconds(fusion::duration_of(exposure, head_.lenses[lens]));
    tags.position = to_geodetic(place);
    tags.sigma_horizontal_m = std::hypot(picture.sigma_position.x(), picture.sigma_position.y());
    const Eigen::Vector3d axis = ecef_from_enu(tags.position).rotation.conjugate() *
                                 (T_ecef_enu.rotation * (picture.T_enu_lens.rotation * Eigen::Vector3d::UnitZ()));
    tags.direction = portable::atan2(axis.x(), axis.y());
    if (tags.direction < 0) tags.direction += 2 * std::numbers::pi;
    const std::vector<std::uint8_t> pixels = pictures_[lens].render(view);
    if (pixels.empty()) {
      files[n] = Error{ErrorCode::Invalid,
                       fmt::format("exposure {}: its image of {} x {} pixels is too small for the lens {} of the rig",
                                   exposure.index, view.width, view.height, head_.lenses[lens].name)};
      return;
    }
    const storage::RgbPixels rgb{pixels.data(), static_cast<int>(shown.width), static_cast<int>(shown.height)};
    files[n] = config_.is_png ? storage::encode_png(rgb, tags) : storage::encode_jpeg(rgb, config_.quality, tags);
  });
  for (std::size_t n = 0; n < chosen.size(); ++n) {
    if (!files[n]) return files[n].error();
    if (Status written = write_output(folder_ / taken[n].file, *files[n]); !written) return written;
    for (const auto& table : tables_) table->add(taken[n]);
    taken_.push_back(taken[n]);
    ++counts_.pictures;
    counts_.copied += is_copied[n];
  }
  return {};
}

Status ImageExport::finish() {
  const std::vector<ColouredPoint> points = sample_.points();
  const std::vector<std::vector<Observation>> seen = seen_points_.find(points, taken_, pictures_, pool_);
  for (const auto& table : tables_) {
    const Status closed = table->close({taken_, points, seen});
    if (status_) status_ = closed;
  }
  return status_;
}

}  // namespace hueline::products
