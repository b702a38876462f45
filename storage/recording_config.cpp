#include "storage/recording_config.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <random>
#include <utility>

namespace hueline::storage {

void RecordingConfig::visit(Keys& keys) {
  keys.number({"segment_mb", "MB",
               "The recording goes on in a new file, a segment, before a file becomes larger than this. All commands "
               "read `drive.mcap` and its segments as one recording.",
               "one file"},
              segment_mb, {0, 1e7});
  keys.number({"segment_min", "min", "The same after this time.", "one file"}, segment_min, {0, 1e5});
  keys.number({"ring_gb", "GB",
               "When all segments together are larger, the oldest are removed. The first segment stays. Those that an "
               "operator's mark protects stay beside the ring and take no room of it.",
               "everything is kept"},
              ring_gb, {0, 1e6});
  keys.number(
      {"ring_h", "h", "Segments whose data is older are removed, with the same exceptions.", "everything is kept"},
      ring_h, {0, 1e5});
  keys.number({"mark_before_min", "min", "What a ring keeps of the time before a mark."}, mark_before_min, {0, 1e5});
  keys.number({"mark_after_min", "min", "What a ring keeps of the time after a mark."}, mark_after_min, {0, 1e5});
  keys.number(
      {"power_cut_s", "s",
       "A power cut loses at most the data of this time. It is forced to the disk's medium after three quarters "
       "of it, and the disk has the last quarter for that."},
      power_cut_s, {0.1, 600});
  keys.flag({"pack_images", "",
             "Whether images that come uncompressed (Bayer mosaics and other pixels of GenICam and V4L2 cameras) are "
             "stored packed, without loss: in a quarter to four fifths of their bytes, for less than a tenth of a "
             "processor core per 300 MB/s. Other programs do not read packed images "
             "([format](formats.md#packed-images))."},
            pack_images);
  keys.texts({"volumes", "",
              "Folders on other disks, where the recording goes on when less than 64 MB are left on its own disk, or "
              "when that disk fails. The drive's folder then has symbolic links to those segments.",
              "none"},
             volumes);
}

KeyError RecordingConfig::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (segment_mb > 0 && segment_mb < 1) return not_allowed("segment_mb", number_text(segment_mb), "0, or 1 and more");
  const bool has_segments = segment_mb > 0 || segment_min > 0;
  for (const auto& [key, value] : {std::pair("ring_gb", ring_gb), std::pair("ring_h", ring_h)})
    if (value > 0 && !has_segments)
      return {key, "needs segments, which are what a ring removes; allowed: only beside segment_mb or segment_min"};
  if (ring_gb > 0 && ring_gb * 1000 < 2 * segment_mb)
    return not_allowed("ring_gb", number_text(ring_gb), "0, or room for two segments of segment_mb at least");
  return {};
}

SegmentedJournal::Config RecordingConfig::journal(std::string name) const {
  SegmentedJournal::Config out;
  out.segment_bytes = static_cast<std::uint64_t>(segment_mb * 1e6);
  out.segment_time = from_seconds(segment_min * 60);
  out.ring_bytes = static_cast<std::uint64_t>(ring_gb * 1e9);
  out.ring_time = from_seconds(ring_h * 3600);
  out.mark_before = from_seconds(mark_before_min * 60);
  out.mark_after = from_seconds(mark_after_min * 60);
  out.volumes.assign(volumes.begin(), volumes.end());
  out.segment.sync_interval = from_seconds(0.75 * power_cut_s);
  out.recording = std::move(name);
  return out;
}

std::string volume_trouble(const std::filesystem::path& volume, const std::filesystem::path& drive) {
  struct stat there {
  }, own{};
  if (::stat(volume.c_str(), &there) != 0 || !S_ISDIR(there.st_mode)) return "is no folder: is its disk mounted?";
  if (::access(volume.c_str(), W_OK | X_OK) != 0) return "cannot be written to: check its rights";
  if (::stat(drive.c_str(), &own) == 0 && own.st_dev == there.st_dev)
    return "lies on the same disk as the recording: is its own disk mounted?";
  return {};
}

std::string random_recording_name() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

}  // namespace hueline::storage
