#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "apps/exit_code.hpp"
#include "apps/export/profile.hpp"
#include "apps/following.hpp"
#include "apps/key_options.hpp"
#include "apps/log.hpp"
#include "config/drive_products.hpp"
#include "config/section.hpp"
#include "core/exposure_choice.hpp"
#include "core/output_file.hpp"
#include "products/image_export.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/recording.hpp"
#include "runtime/version.hpp"

namespace hueline::apps {
namespace {

std::uint64_t files_below(const std::filesystem::path& folder) {
  std::uint64_t count = 0;
  std::error_code error;  // a folder that cannot be read has none
  for (std::filesystem::recursive_directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    count += at->is_regular_file(error) ? 1 : 0;
  return count;
}

/// Passes on the exposures that are chosen.
class Chosen : public runtime::ProductSink {
 public:
  Chosen(products::ImageExport& images, const ExposureChoice& choice, nanoseconds together)
      : images_(images), choice_(choice), together_(together) {}

  void on_origin(const Geodetic& origin) override { images_.set_origin(origin); }
  void on_exposure(const Exposure& exposure) override {
    exposures_.insert(exposure.index);
    if (is_chosen(exposure)) images_.add(exposure);
  }
  void on_settled_exposure(const Exposure& exposure, const fusion::Trajectory& trajectory) override {
    status_ = images_.settle(exposure, trajectory);
  }
  void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override { images_.add(block); }
  const Status& status() const { return status_; }
  /// The numbers of the drive's exposures.
  const std::set<std::uint32_t>& exposures() const { return exposures_; }

 private:
  bool is_chosen(const Exposure& exposure) {
    if (!choice_.has_number(exposure.index) || !choice_.has_time(exposure.exposure_mid)) return false;
    if (choice_.every == 1) return true;
    // The exposures of several cameras at one moment are chosen or left together.
    constexpr std::size_t kRecent = 64;
    const GpsTime time = exposure.exposure_mid;
    for (const auto& [other, is_one] : recent_)
      if ((time > other ? time - other : other - time) <= together_) return is_one;
    recent_.emplace_back(time, moments_++ % choice_.every == 0);
    if (recent_.size() > kRecent) recent_.pop_front();
    return recent_.back().second;
  }

  products::ImageExport& images_;
  ExposureChoice choice_;
  nanoseconds together_;
  std::deque<std::pair<GpsTime, bool>> recent_;
  std::int64_t moments_ = 0;
  std::set<std::uint32_t> exposures_;
  Status status_;
};

class ImagesProfile : public ExportProfile {
 public:
  const char* word() const override { return "images"; }
  const char* help() const override {
    return "the lens images of the exposures, with their poses: COLMAP's text model, nerfstudio's transforms.json, "
           "poses.csv";
  }
  bool writes_folder(const ExportWords&) const override { return true; }

  void declare(Command& command) override {
    given_.declare(command, group_of(keys_), "images: ");
    command.option("--from", from_s_, "images: only exposures from this GPS time on, s");
    command.option("--to", to_s_, "images: only exposures up to this GPS time, s");
    command.setting("--points", points_, "images: most points of the cloud that are written with the poses",
                    {.least = 0, .most = 10'000'000});
    Following::declare(command, follows_, "images: ");
    command.excludes("--follow", "--trajectory");
  }

  int run(const ExportWords& words) override {
    given_.read(group_of(keys_));
    ExposureChoice choice = ExposureChoice::parse(keys_.exposures).value();
    if (Status limited = choice.limit(from_s_, to_s_); !limited.ok())
      throw config::ConfigError(limited.error().message);
    std::optional<Following> following;
    if (follows_) runtime::wait_for_recording(words.drive, following.emplace().asked());
    auto recording = runtime::Recording::open(words.drive, words.rig);
    if (!recording.ok()) {
      log_error(recording.error().message);
      return opening_status(recording.error());
    }
    if (following) recording->follows = following->asked();
    const config::Rig& rig = recording->rig;
    if (rig.geometry.head.lenses.empty())
      throw config::ConfigError("the rig has no camera head: there are no images to write");
    const auto trajectory = words.trajectory.open(words.drive, words.rig);
    if (!trajectory.ok()) {
      log_error(trajectory.error().message);
      return opening_status(trajectory.error());
    }
    auto folder = OutputFolder::open(words.out);
    if (!folder.ok()) {
      log_error(folder.error().message);
      return kOutputRefused;
    }
    products::ImageExport::Config config;
    config.pixels = keys_.lens == "pinhole" ? products::LensPixels::Pinhole : products::LensPixels::Recorded;
    config.is_png = keys_.format == "png";
    config.quality = keys_.quality;
    config.most_points = static_cast<std::size_t>(points_);
    config.threads = words.threads;
    config.software = std::string("hueline ") + runtime::kVersion;
    products::ImageExport images(folder->path(), rig.geometry.head, rig.map, config);
    Chosen sink(images, choice, rig.colouring.together);
    Status read;
    {
      config::Rig sensors = rig;
      if (points_ == 0) sensors.geometry.lasers.clear();  // no point is placed, so none is coloured
      runtime::Pipeline pipeline(sensors, words.threads, sink, trajectory->get());
      read = recording->for_each([&](const Packet& packet) {
        images.add(packet);
        pipeline.process(packet);
        return sink.status().ok();
      });
      pipeline.flush();
    }
    if (const Status finished = images.finish(); !finished.ok()) {
      log_error(finished.error().message);
      return finished.error().code == ErrorCode::Invalid ? kWrongUse : kOutputRefused;
    }
    const std::optional<std::uint32_t> missing = read.ok() ? choice.missing_number(sink.exposures()) : std::nullopt;
    if (*trajectory) {
      std::fputs((*trajectory)->comparison().text().c_str(), stdout);
      if (read.ok()) read = (*trajectory)->status();
    }
    const int status = tell(words, images, read);
    const bool is_missed = following && Following::tell_missed(*recording);
    if (images.counts().exposures == 0)
      log_error("the drive has {} exposures; none is chosen", sink.exposures().size());
    if (!missing) return status == kDone && is_missed ? kInputUnreadable : status;
    log_error("the drive has no exposure {}", *missing);
    return kNothingCame;
  }

 private:
  static int tell(const ExportWords& words, const products::ImageExport& images, const Status& read) {
    const auto& counts = images.counts();
    fmt::print("{}: {} pictures of {} exposures{}\n", words.out, counts.pictures, counts.exposures,
               counts.copied == 0 ? "" : fmt::format(", {} of them JPEGs as received", counts.copied));
    const auto warn = [](std::uint64_t count, const char* what) {
      if (count > 0) log_warning("{} {}", count, what);
    };
    warn(counts.without_time, "exposures have no time, so no pose");
    warn(counts.incomplete, "exposures are left out, because their image lacks parts");
    warn(counts.lost_lenses, "pictures are left out, because a part of their image could not be decoded");
    warn(counts.without_pose, "exposures have no pose, because solutions of the POS are missing there");
    warn(counts.early, "exposures are left out, because their pose came too late for the memory");
    for (const std::string& one : images.missing_tables()) log_warning("{}", one);
    if (const std::uint64_t all = files_below(std::filesystem::path(words.out) / "images"); all > counts.pictures)
      log_warning("{}/images has {} more pictures, of an earlier export; the tables do not list them", words.out,
                  all - counts.pictures);
    if (!read.ok()) {
      log_error("{}: everything that is whole was used", read.error().message);
      return kInputUnreadable;
    }
    return counts.pictures == 0 ? kNothingCame : kDone;
  }

  config::ImageKeys keys_;
  KeyOptions given_;  // of keys_
  double from_s_ = std::nan(""), to_s_ = std::nan("");
  int points_ = 200'000;
  bool follows_ = false;
};

}  // namespace

std::unique_ptr<ExportProfile> make_images_profile() { return std::make_unique<ImagesProfile>(); }

}  // namespace hueline::apps
