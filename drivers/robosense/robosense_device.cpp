#include "drivers/robosense/robosense_device.hpp"

#include <fmt/format.h>

#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "drivers/beam_angles.hpp"
#include "drivers/robosense/robosense_decoder.hpp"
#include "drivers/transport/datagram_device.hpp"
#include "drivers/transport/pcap_source.hpp"

namespace hueline::drivers {
namespace {

constexpr const char* kUnchecked =
    "the decoder follows the maker's manuals: no recording of such a scanner was there to check it";

/// Returns the first description that the scanner sends in a capture. It comes once a second, and a scanner sends at
/// most a few thousand packets in that time.
std::vector<std::byte> find_description(const std::string& path, const std::string& address) {
  PcapSource source({.path = path, .ports = {}, .source_address = address, .protocol = PcapSource::Protocol::Udp});
  if (!source.open().ok()) return {};
  for (int packets = 0; packets < 50'000; ++packets) {
    const Result<Packet> packet = source.next({});
    if (!packet.ok()) return {};
    if (packet->kind != PacketKind::Wire || !is_robosense_description(packet->bytes.bytes())) continue;
    const auto bytes = packet->bytes.bytes();
    return {bytes.begin(), bytes.end()};
  }
  return {};
}

class RobosenseListener final : public CaptureListener {
 public:
  explicit RobosenseListener(std::string path) : path_(std::move(path)) {}

  Status use_description(const std::string& file) override {
    auto angles = read_beam_angles(file);
    if (!angles.ok()) return angles.error();
    given_.push_back(std::move(angles).value());
    return {};
  }

  std::optional<HeardDevice> listen(const Packet& datagram, const std::string& sender) override {
    const auto bytes = datagram.bytes.bytes();
    if (const auto solid = decode_robosense_solid(bytes))
      return HeardDevice{std::string("robosense ") + solid->name,
                         std::make_unique<RobosenseDecoder>(RobosenseDecoder::Config{}), kUnchecked};
    if (!is_robosense_points(bytes)) {
      if (has_robosense_signature(bytes) && unknown_.size() < 16)
        unknown_.insert(fmt::format("with packets of {} bytes", bytes.size()));
      return {};
    }
    auto model = robosense_model(bytes);
    if (!model) {
      const std::string type = fmt::format("of type {}.{}.{}", static_cast<unsigned>(bytes[30]),
                                           static_cast<unsigned>(bytes[31]), static_cast<unsigned>(bytes[32]));
      if (unknown_.size() < 16) unknown_.insert(type);
      return {};
    }
    auto description = find_description(path_, sender);
    const bool is_told = decode_robosense_description(description, *model).has_value();
    RobosenseDecoder::Config config;
    std::string note, used;
    for (const BeamAngles& one : given_) {
      const bool can_be = one.elevations_deg.size() == static_cast<std::size_t>(robosense_table(*model).beams) ||
                          (!is_told && *model == RobosenseModel::Helios && one.elevations_deg.size() == 16);
      if (!can_be) continue;
      config.elevations_deg = one.elevations_deg;
      config.azimuths_deg = one.azimuths_deg;
      note = "directions of the beams: " + one.file;
      used = one.file;
    }
    if (note.empty())
      note = is_told
                 ? "directions of the beams: the scanner's own description"
                 : "the file has no description of the scanner (DIFOP, usually port 7788), which has the directions of "
                   "its beams: without it, or a calibration file, there are no points";
    note += std::string("; ") + kUnchecked;
    return HeardDevice{std::string("robosense ") + robosense_table(*model).name,
                       std::make_unique<RobosenseDecoder>(config, std::move(description)), std::move(note),
                       std::move(used)};
  }
  bool is_decodable(const Packet& datagram) const override {
    const auto bytes = datagram.bytes.bytes();
    return is_robosense_points(bytes) || is_robosense_description(bytes) || decode_robosense_solid(bytes);
  }
  std::string unknown_models() const override {
    std::string out;
    for (const std::string& one : unknown_) out += (out.empty() ? "a RoboSense " : " or ") + one;
    return out.empty() ? out : out + "; known: RS-LiDAR-16 and -32, RS-Bpearl, RS-Helios, RS-LiDAR-M1 and -E1";
  }

 private:
  const std::string path_;
  std::vector<BeamAngles> given_;
  std::set<std::string> unknown_;
};

}  // namespace

// A packet spans 0.3 to 1.3 ms.
constinit const DeviceType kRobosense{
    .word = "robosense",
    .role = Role::Laser,
    .is_sheddable = false,
    .make = make_device<DatagramDevice<RobosenseDecoder>>,
    .laser = {.latency_min = std::chrono::microseconds(300), .pending_limit = 16384},
    .files = {.capture = {.kind = "a RoboSense",
                          .has_signature = true,
                          .listen = [](const std::string& path) -> std::unique_ptr<CaptureListener> {
                            return std::make_unique<RobosenseListener>(path);
                          }}}};

}  // namespace hueline::drivers
