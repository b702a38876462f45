#include "drivers/hesai/hesai_listener.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "drivers/hesai/hesai_angles.hpp"
#include "drivers/hesai/hesai_decoder.hpp"
#include "drivers/hesai/hesai_wire.hpp"

namespace hueline::drivers {
namespace {

/// Returns which product that is not supported the protocol of a data packet belongs to, such as " (AT128)".
std::string other_hesai(std::span<const std::byte> bytes) {
  const auto u8 = [&](std::size_t at) { return static_cast<unsigned>(bytes[at]); };
  switch (u8(2) << 8U | u8(3)) {
    case 0x0104:
      return u8(4) >= 137 ? " (JT128)" : "";
    case 0x0108:
      return " (JT16)";
    case 0x0401:
    case 0x0403:
      return " (AT128)";
    case 0x0407:
      return " (ATX)";
    case 0x0702:
      return " (FT120)";
    default:
      return "";
  }
}

class HesaiListener final : public CaptureListener {
 public:
  explicit HesaiListener(std::string path) : path_(std::move(path)) {}

  Status use_description(const std::string& file) override {
    auto angles = read_beam_angles(file);
    if (!angles.ok()) return angles.error();
    given_.push_back(std::move(angles).value());
    return {};
  }

  std::optional<HeardDevice> listen(const Packet& datagram, const std::string&) override {
    const auto bytes = datagram.bytes.bytes();
    const auto model = hesai_model(bytes);
    if (!model) {
      if (has_hesai_header(bytes) && unknown_.size() < 16)
        unknown_.insert(fmt::format("{} channels in {} blocks, {} bytes, protocol {}.{}{}",
                                    static_cast<unsigned>(bytes[6]), static_cast<unsigned>(bytes[7]), bytes.size(),
                                    static_cast<unsigned>(bytes[2]), static_cast<unsigned>(bytes[3]),
                                    other_hesai(bytes)));
      return {};
    }
    const HesaiTable& table = hesai_table(*model);
    HesaiDecoder::Config config;
    config.model = *model;
    std::optional<BeamAngles> angles;
    for (const BeamAngles& one : given_)
      if (std::string wrong = why_not_of(table, one); wrong.empty())
        angles = one;
      else
        not_used_[one.file] = std::move(wrong);
    const std::string description = angles ? angles->file : "";
    std::string beside;  // why the file beside the capture is not used
    if (!angles) angles = find_hesai_angles(path_, table);
    if (angles && description.empty()) {
      if (const std::string wrong = why_not_of(table, *angles); !wrong.empty()) {
        beside = fmt::format("; {} beside the capture is not used: {}", angles->file, wrong);
        angles.reset();
      }
    }
    if (angles) {
      config.elevations_deg = angles->elevations_deg;
      config.azimuths_deg = angles->azimuths_deg;
    }
    return HeardDevice{std::string("hesai ") + table.name, std::make_unique<HesaiDecoder>(config),
                       angles ? "directions of the beams: " + angles->file
                              : "directions of the beams: the model's nominal ones, which a scanner misses by some "
                                "tenths of a degree; its own calibration file gives them" +
                                    beside,
                       description};
  }

  std::string why_not_used(const std::string& description) const override {
    const auto found = not_used_.find(description);
    return found == not_used_.end() ? std::string() : found->second;
  }

  bool is_decodable(const Packet& datagram) const override {
    return hesai_model(datagram.bytes.bytes()).has_value() || decode_hesai_gps(datagram.bytes.bytes()).has_value();
  }

  std::string unknown_models() const override {
    std::string out;
    for (const std::string& one : unknown_) out += (out.empty() ? "a Hesai with " : " or ") + one;
    return out;
  }

 private:
  const std::string path_;
  std::vector<BeamAngles> given_;
  std::map<std::string, std::string> not_used_;  // by file: why
  std::set<std::string> unknown_;
};

}  // namespace

std::unique_ptr<CaptureListener> listen_for_hesai(const std::string& path) {
  return std::make_unique<HesaiListener>(path);
}

}  // namespace hueline::drivers
