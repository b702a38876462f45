#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/exit_code.hpp"
#include "apps/export/drive_path.hpp"
#include "apps/export/profile.hpp"
#include "apps/inspect/unfinished_run.hpp"
#include "apps/log.hpp"
#include "config/section.hpp"
#include "core/input_file.hpp"
#include "core/output_file.hpp"
#include "products/cloud_export.hpp"
#include "products/cloud_split.hpp"
#include "runtime/recording.hpp"
#include "runtime/version.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/las_reader.hpp"
#include "storage/part_index.hpp"

namespace hueline::apps {
namespace {

/// Returns the times at which the strips of a drive end, by its path.
Result<std::vector<GpsTime>> ends_of_strips(const ExportWords& words, double length_m) {
  auto recording = runtime::Recording::open(words.drive, words.rig);
  if (!recording.ok())
    return Error{recording.error().code, recording.error().message +
                                             " (strips by distance need the drive's folder or its recording, because "
                                             "a cloud does not hold the path)"};
  storage::PathStrips path(length_m);
  const auto read =
      for_each_of_path(words.trajectory, *recording, [&](const InsSolution& solution) { path.add(solution); });
  if (!read.ok()) return read.error();
  if (!read->ok()) log_warning("{}: the path is known as far as its files are whole", read->error().message);
  return path.ends();
}

/// Returns the exit status of an export that failed: by the new file, the cloud or what was asked for.
int failed_status(const Error& error) {
  if (error.code == ErrorCode::EndOfData) return kNothingCame;
  return error.code == ErrorCode::Io ? kOutputRefused : opening_status(error);
}

void tell_left_out(const std::string& out, const std::vector<std::string>& records) {
  for (const std::string& record : records) log_warning("not in {}: {}", out, record);
}

/// Says that the new file has no CRS because that of the cloud is not known. LAZ has a copy of the keys.
void tell_unread_crs(const std::string& out, const std::string& cloud) {
  const auto source = storage::LasReader::open(cloud);
  if (!source.ok()) return;
  if (const Result<bool> has_unread = storage::has_unread_crs(*source); has_unread.ok() && *has_unread)
    log_warning(
        "{} has no CRS: the GeoTIFF keys of {} describe a projection that is not known here (known are Transverse "
        "Mercator, Mercator, Lambert's conformal conic and Albers, in degrees)",
        out, cloud);
}

/// Returns how many compressed clouds a folder has beside these.
std::size_t other_parts(const std::filesystem::path& folder, const std::vector<storage::CloudPart>& parts) {
  std::size_t count = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    count += at->path().extension() == ".laz" &&
             std::ranges::find(parts, at->path().filename(), &storage::CloudPart::file) == parts.end();
  return count;
}

int write_parts(const ExportWords& words, const std::string& cloud, bool is_copc, const products::CloudExport& config) {
  const auto split = storage::CloudSplit::parse(words.split);
  if (!split.ok()) throw config::ConfigError("--split: " + split.error().message);
  std::vector<GpsTime> ends;
  if (split->kind == storage::CloudSplit::Kind::Distance) {
    auto known = ends_of_strips(words, split->size);
    if (!known.ok()) {
      log_error(known.error().message);
      return opening_status(known.error());
    }
    ends = std::move(*known);
  }
  auto folder = OutputFolder::open(words.out);
  if (!folder.ok()) {
    log_error(folder.error().message);
    return kOutputRefused;
  }
  const std::filesystem::path index = folder->path() / storage::kPartIndex;
  const auto done = products::split_cloud(cloud, folder->path(), *split, ends, is_copc, config);
  if (!done.ok()) {
    log_error(done.error().message);
    // Parts that it lists may have been replaced.
    if (std::error_code error; done.error().code == ErrorCode::Io && std::filesystem::remove(index, error))
      log_warning("{} of an earlier export was removed", index.string());
    return failed_status(done.error());
  }
  const auto source = storage::LasReader::open(cloud);
  const Result<std::string> wkt = source.ok() ? storage::crs_wkt(*source) : Result<std::string>(source.error());
  if (!wkt.ok()) {
    log_error(wkt.error().message);
    return opening_status(wkt.error());
  }
  const Result<std::size_t> indexed = storage::write_part_index(index, done->parts, *wkt);
  if (!indexed.ok()) {
    log_error(indexed.error().message);
    return kOutputRefused;
  }
  if (*indexed > 0)
    log_warning("index.geojson has no rectangles of {} parts: {}", *indexed,
                wkt->empty() ? "the cloud says no CRS, neither in words (WKT) nor by its number (EPSG)"
                             : "their coordinates are no places of the cloud's CRS, or it is neither projected nor "
                               "geographic");
  if (const std::size_t others = other_parts(folder->path(), done->parts); others > 0)
    log_warning("{} has {} more clouds, as of an earlier export; index.geojson does not list them", words.out, others);
  if (done->unfinished_removed > 0)
    log_warning("{} files of parts were removed that an earlier export has left unfinished", done->unfinished_removed);
  tell_left_out(words.out, source->left_out());
  if (is_copc) tell_unread_crs(words.out, cloud);
  std::uint64_t points = 0, bytes = 0;
  for (const storage::CloudPart& part : done->parts) {
    points += part.points;
    bytes += part.bytes;
  }
  fmt::print("{}: {} points in {} {}, {} bytes; index.geojson says where\n", words.out, points, done->parts.size(),
             split->is_strips() ? "strips" : "tiles", bytes);
  if (!done->source_was_cut) return kDone;
  log_error("{} ends before its last point: everything that is whole was written", cloud);
  return kInputUnreadable;
}

class LazProfile : public ExportProfile {
 public:
  const char* word() const override { return "laz"; }
  const char* help() const override { return "the cloud as LAZ with all its fields, extra bytes included"; }

  bool writes_folder(const ExportWords& words) const override { return !words.split.empty(); }
  std::string ending() const override { return ".laz"; }
  bool is_name(const std::string& name) const override {
    return name.ends_with(ending()) && !name.ends_with(".copc.laz");
  }
  bool splits() const override { return true; }
  bool reads_recording(const ExportWords& words) const override { return words.split.starts_with("distance"); }

  int run(const ExportWords& words) override {
    products::CloudExport config;
    config.threads = words.threads;
    const auto found = runtime::find_cloud(words.drive);
    if (!found.ok()) {
      log_error(found.error().message);
      return kInputUnreadable;
    }
    const std::string& cloud = *found;
    return work_on_cloud(cloud, [&] {
      return words.split.empty() ? write_whole(words, cloud, config) : write_parts(words, cloud, is_copc(), config);
    });
  }

 protected:
  virtual bool is_copc() const { return false; }
  /// Whether the records of the cloud are in the new file as they are.
  virtual bool keeps_records() const { return true; }
  virtual const char* parts() const { return "chunks"; }
  virtual Result<products::ExportedCloud> write(const std::string& cloud, const std::string& out,
                                                const products::CloudExport& config) const {
    return products::export_laz(cloud, out, config);
  }

 private:
  int write_whole(const ExportWords& words, const std::string& cloud, const products::CloudExport& config) const {
    const auto done = write(cloud, words.out, config);
    if (!done.ok()) {
      log_error(done.error().message);
      return failed_status(done.error());
    }
    const auto source = InputFile::open(cloud);
    const double size = source.ok() ? static_cast<double>(source->size()) : 0;
    fmt::print("{}: {} points in {} {}, {} bytes, {:.3f} of the size of {}\n", words.out, done->points, done->nodes,
               parts(), done->bytes, static_cast<double>(done->bytes) / size, cloud);
    tell_left_out(words.out, done->left_out);
    if (!keeps_records()) tell_unread_crs(words.out, cloud);
    if (!done->source_was_cut) return done->points == 0 ? kNothingCame : kDone;
    log_error("{} ends before its last point: everything that is whole was written", cloud);
    return kInputUnreadable;
  }
};

class CopcProfile : public LazProfile {
 public:
  const char* word() const override { return "copc"; }
  const char* help() const override {
    return "the same as COPC 1.0: an octree that viewers load in parts, from a disk or a web server (.copc.laz)";
  }
  std::string ending() const override { return ".copc.laz"; }
  bool is_name(const std::string& name) const override { return name.ends_with(".laz"); }

 protected:
  bool is_copc() const override { return true; }
  bool keeps_records() const override { return false; }
  const char* parts() const override { return "nodes of an octree"; }
  Result<products::ExportedCloud> write(const std::string& cloud, const std::string& out,
                                        const products::CloudExport& config) const override {
    return products::export_copc(cloud, out, config);
  }
};

class PlyProfile : public LazProfile {
 public:
  const char* word() const override { return "ply"; }
  const char* help() const override {
    return "the cloud as binary PLY: place, colour, intensity, return, class, sensor, time and extra bytes";
  }
  std::string ending() const override { return ".ply"; }
  bool is_name(const std::string& name) const override { return name.ends_with(ending()); }
  bool splits() const override { return false; }

 protected:
  const char* parts() const override { return "piece"; }
  bool keeps_records() const override { return false; }
  Result<products::ExportedCloud> write(const std::string& cloud, const std::string& out,
                                        const products::CloudExport&) const override {
    return products::export_ply(cloud, out);
  }
};

class E57Profile : public PlyProfile {
 public:
  const char* word() const override { return "e57"; }
  const char* help() const override {
    return "the cloud as E57 (ASTM E2807): places, colours, intensity, returns, times";
  }
  std::string ending() const override { return ".e57"; }

 protected:
  Result<products::ExportedCloud> write(const std::string& cloud, const std::string& out,
                                        const products::CloudExport&) const override {
    return products::export_e57(cloud, out, std::string("hueline ") + runtime::kVersion);
  }
};

}  // namespace

std::unique_ptr<ExportProfile> make_laz_profile() { return std::make_unique<LazProfile>(); }
std::unique_ptr<ExportProfile> make_copc_profile() { return std::make_unique<CopcProfile>(); }
std::unique_ptr<ExportProfile> make_e57_profile() { return std::make_unique<E57Profile>(); }
std::unique_ptr<ExportProfile> make_ply_profile() { return std::make_unique<PlyProfile>(); }

}  // namespace hueline::apps
