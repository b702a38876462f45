#include "drivers/ouster/ouster_listener.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "drivers/ouster/ouster_decoder.hpp"
#include "drivers/ouster/ouster_file.hpp"
#include "drivers/ouster/ouster_wire.hpp"

namespace hueline::drivers {
namespace {

/// Metadata and the file that they are from.
struct Described {
  OusterMetadata metadata;
  std::string file;
};

std::optional<Described> described_by(const std::filesystem::path& file) {
  const auto text = read_ouster_metadata_file(file.string());
  if (!text.ok()) return {};
  auto metadata = parse_ouster_metadata(*text);
  if (!metadata.ok()) return {};
  return Described{std::move(metadata).value(), file.string()};
}

/// Returns the metadata beside a capture: those whose files' names begin with the capture's, or else all.
std::vector<Described> beside(const std::string& path) {
  constexpr std::size_t kMostFiles = 100;
  std::vector<std::filesystem::path> files;
  std::error_code error;
  const std::filesystem::path capture(path), folder = capture.parent_path();
  for (std::filesystem::directory_iterator entry(folder.empty() ? "." : folder, error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().extension() == ".json" && files.size() < kMostFiles) files.push_back(entry->path());
  std::ranges::sort(files);
  std::vector<Described> named, all;
  for (const auto& file : files) {
    auto described = described_by(file);
    if (!described) continue;
    if (file.filename().string().starts_with(capture.stem().string())) named.push_back(*described);
    all.push_back(std::move(*described));
  }
  return named.empty() ? all : named;
}

class OusterListener final : public CaptureListener {
 public:
  explicit OusterListener(std::string path) : path_(std::move(path)) {}

  Status use_description(const std::string& file) override {
    const auto text = read_ouster_metadata_file(file);
    if (!text.ok()) return text.error();
    auto metadata = parse_ouster_metadata(*text);
    if (!metadata.ok()) {
      // Another kind of device may know a text that is not JSON.
      const bool is_json_text = is_json(std::as_bytes(std::span(*text)));
      return Error{is_json_text ? metadata.error().code : ErrorCode::Unsupported,
                   file + ": " + metadata.error().message};
    }
    given_.push_back({std::move(metadata).value(), file});
    return {};
  }

  std::optional<HeardDevice> listen(const Packet& datagram, const std::string&) override {
    const auto bytes = datagram.bytes.bytes();
    if (!looks_like_ouster(bytes) && !is_described(given_, bytes)) {
      imu_packets_ += is_ouster_imu(bytes) ? 1 : 0;
      return {};
    }
    has_data_ = true;
    const std::vector<Described>* choice = &given_;
    if (!is_described(given_, bytes)) {
      if (!beside_) beside_ = beside(path_);
      choice = &*beside_;
    }
    std::vector<const Described*> fitting;
    for (const Described& one : *choice)
      if (fits(one, bytes)) fitting.push_back(&one);
    // Files with the same beams are the same metadata twice.
    const bool is_clear = !fitting.empty() && std::ranges::all_of(fitting, [&](const Described* one) {
      return one->metadata.altitudes_deg == fitting.front()->metadata.altitudes_deg &&
             one->metadata.azimuths_deg == fitting.front()->metadata.azimuths_deg;
    });
    if (!is_clear) {
      if (unknown_.size() < 16) unknown_[bytes.size()] = fitting.empty() ? "" : rivals(fitting);
      return {};
    }
    const Described& found = *fitting.front();
    if (!is_described(used_, bytes)) used_.push_back(found);
    const OusterMetadata& metadata = found.metadata;
    std::string name = "ouster " + metadata.name() + ", " + metadata.profile->name;
    const double up_mm = metadata.p_sensor_lidar_m.z() * 1e3;
    return HeardDevice{std::move(name), std::make_unique<OusterDecoder>(OusterDecoder::Config{}, metadata),
                       fmt::format("metadata: {}; origin: the centre of the beams, {:.2f} mm above that of the maker's "
                                   "sensor frame",
                                   found.file, up_mm),
                       choice == &given_ ? found.file : ""};
  }

  bool is_decodable(const Packet& datagram) const override {
    const auto bytes = datagram.bytes.bytes();
    return is_described(used_, bytes) || (!used_.empty() && ouster_other(bytes).has_value());
  }

  std::string lone_packets() const override {
    if (has_data_ || imu_packets_ == 0) return {};
    return fmt::format("{} packet{} of the inertial sensor of an Ouster, and no data packets, which have its points",
                       imu_packets_, imu_packets_ == 1 ? "" : "s");
  }

  std::string unknown_models() const override {
    std::string out;
    for (const auto& [bytes, why] : unknown_)
      out += fmt::format("{}an Ouster whose data packets have {} bytes, without its metadata{}",
                         out.empty() ? "" : " or ", bytes, why);
    if (!out.empty())
      out +=
          ". The metadata are the JSON text that the scanner gives at http://ADDRESS/api/v1/sensor/metadata; put them "
          "beside the capture under its name, with the ending .json, or name them with --calibration";
    return out;
  }

 private:
  /// Says which files describe different scanners of whom each may be the one.
  static std::string rivals(const std::vector<const Described*>& fitting) {
    constexpr std::size_t kMostNamed = 4;
    std::string names;
    for (std::size_t i = 0; i < std::min(kMostNamed, fitting.size()); ++i)
      names += (i == 0 ? "" : ", ") + std::filesystem::path(fitting[i]->file).filename().string();
    return fmt::format(" ({} files fit and describe different scanners: {}{})", fitting.size(), names,
                       fitting.size() > kMostNamed ? ", ..." : "");
  }
  static bool fits(const Described& one, std::span<const std::byte> bytes) {
    if (!is_ouster_packet(bytes, one.metadata)) return false;
    const auto serial = decode_ouster_header(bytes, one.metadata).serial;
    return !serial || !one.metadata.serial || *serial == *one.metadata.serial;
  }
  static bool is_described(const std::vector<Described>& all, std::span<const std::byte> bytes) {
    return std::ranges::any_of(all, [&](const Described& one) { return fits(one, bytes); });
  }

  const std::string path_;
  std::uint64_t imu_packets_ = 0;  ///< before a data packet
  bool has_data_ = false;
  std::vector<Described> given_, used_;
  std::optional<std::vector<Described>> beside_;
  std::map<std::size_t, std::string> unknown_;  ///< by size of the packets
};

}  // namespace

std::unique_ptr<CaptureListener> listen_for_ouster(const std::string& path) {
  return std::make_unique<OusterListener>(path);
}

}  // namespace hueline::drivers
