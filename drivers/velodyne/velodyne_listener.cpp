#include "drivers/velodyne/velodyne_listener.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "drivers/transport/pcap_source.hpp"
#include "drivers/velodyne/velodyne_angles.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"
#include "drivers/velodyne/velodyne_position.hpp"
#include "drivers/velodyne/velodyne_timing.hpp"

namespace hueline::drivers {
namespace {

/// Returns the model of the Velodyne that sent this datagram, by the timing of its packets, or nothing where the
/// factory byte decides. Other scanners may have its address, its port, or both.
std::optional<VelodyneModel> timed_model(const std::string& path, const std::string& address, const Packet& datagram) {
  if (!is_told_by_timing(velodyne_product(datagram.bytes.bytes()))) return {};
  PcapSource source({.path = path, .ports = {}, .source_address = address});
  if (!source.open().ok()) return {};
  std::optional<std::pair<HardwareAddress, std::uint16_t>> stream;  // the scanner's card and the port it sends to
  VelodyneTiming timing;
  for (int packets = 0; packets < 10'000;) {
    const Result<Packet> packet = source.next({});
    if (!packet.ok()) return {};
    if (packet->kind != PacketKind::Wire || packet->bytes.size() != kVelodyneDataBytes) continue;
    const std::pair from(source.sender_card(), source.destination_port());
    if (!stream && packet->received == datagram.received &&
        std::ranges::equal(packet->bytes.bytes(), datagram.bytes.bytes()))
      stream = from;
    if (!stream) continue;
    ++packets;
    if (from != *stream || velodyne_product(packet->bytes.bytes()) != velodyne_product(datagram.bytes.bytes()))
      continue;
    timing.add(packet->bytes.bytes());
    // Other models have factory bytes of their own.
    if (const auto model = timing.model(3))
      return *model == VelodyneModel::Vlp16 || *model == VelodyneModel::Hdl32e ? model : std::nullopt;
  }
  return {};
}

class VelodyneListener final : public CaptureListener {
 public:
  explicit VelodyneListener(std::string path) : path_(std::move(path)) {}

  Status use_description(const std::string& file) override {
    auto calibration = read_velodyne_calibration(file);
    if (!calibration.ok()) return calibration.error();
    given_.push_back(std::move(calibration).value());
    return {};
  }

  std::optional<HeardDevice> listen(const Packet& datagram, const std::string& sender) override {
    if (datagram.bytes.size() != kVelodyneDataBytes) {
      const auto position = decode_position(datagram.bytes.bytes());
      if (position.ok() && position->nmea.starts_with('$')) ++positions_;
      return {};
    }
    has_data_ = true;
    if (is_hdl64e(datagram.bytes.bytes())) {
      has_hdl64e_ = true;
      return {};
    }
    const std::uint8_t product = velodyne_product(datagram.bytes.bytes());
    if (unknown_.contains({sender, product})) return {};
    const auto mode = static_cast<std::uint8_t>(datagram.bytes.bytes()[kVelodyneModeAt]);
    if (!is_velodyne_mode(mode) && is_known(product)) {
      modes_.emplace(std::pair(sender, product), mode);
      return {};
    }
    const auto timed = timed_model(path_, sender, datagram);
    for (const VelodyneModel model : kVelodyneModels) {
      const VelodyneTable& table = velodyne_table(model);
      const bool has_its_byte = table.product_id == product;
      if (timed ? model != *timed : !has_its_byte) continue;
      std::string name = std::string("velodyne ") + table.name;
      if (!has_its_byte) name += ", by its timing (factory byte of " + velodyne_product_name(product) + ")";
      VelodyneDecoder::Config config;
      config.model = model;
      modes_.erase({sender, product});  // a packet or two were damaged
      const std::string description = describe(table, config);
      return HeardDevice{std::move(name), std::make_unique<VelodyneDecoder>(config),
                         description.empty() ? std::string() : "directions of the beams: " + description, description};
    }
    unknown_.emplace(sender, product);
    return {};
  }

  bool is_decodable(const Packet& datagram) const override {
    return datagram.bytes.size() == kVelodyneDataBytes || datagram.bytes.size() == kVelodynePositionBytes;
  }

  std::string why_not_used(const std::string& description) const override {
    const auto found = not_used_.find(description);
    return found == not_used_.end() ? std::string() : found->second;
  }

  std::string lone_packets() const override {
    if (has_data_ || positions_ == 0) return {};
    return fmt::format(
        "{} position packet{} of a Velodyne (512 bytes, with the sentences of its receiver), without the "
        "data packets (1206 bytes, usually to port 2368) that have its points and its model",
        positions_, positions_ == 1 ? "" : "s");
  }

  std::string unknown_models() const override {
    std::string odd;
    for (const auto& [from, mode] : modes_)
      odd += fmt::format("{}a Velodyne {} in return mode 0x{:02X}{}; known: strongest (0x37), last (0x38), dual (0x39)",
                         odd.empty() ? "" : "; ", velodyne_product_name(from.second), mode,
                         mode == 0x3B ? " (dual with confidence)" : "");
    if (unknown_.empty() && !has_hdl64e_) return odd;
    std::set<std::uint8_t> products;
    for (const auto& [sender, product] : unknown_) products.insert(product);
    std::string named = has_hdl64e_ ? "HDL-64E" : "", known;
    for (const std::uint8_t product : products)
      named += fmt::format("{}{}", named.empty() ? "" : ", ", velodyne_product_name(product));
    for (const VelodyneModel model : kVelodyneModels)
      known += fmt::format("{}0x{:02X} ({})", known.empty() ? "" : ", ", velodyne_table(model).product_id,
                           velodyne_table(model).name);
    return fmt::format("{}{}a Velodyne of product {}; known: {}", odd, odd.empty() ? "" : "; ", named, known);
  }

 private:
  static bool is_known(std::uint8_t product) {
    return std::ranges::any_of(kVelodyneModels,
                               [&](VelodyneModel model) { return velodyne_table(model).product_id == product; });
  }
  /// Sets the directions of the given file that fits the model, and returns its name. Nothing: none fits.
  std::string describe(const VelodyneTable& table, VelodyneDecoder::Config& config) {
    std::string used;
    for (const VelodyneCalibration& one : given_) {
      if (std::string wrong = why_not_of(table, one); !wrong.empty()) {
        not_used_[one.angles.file] = std::move(wrong);
        continue;
      }
      used = one.angles.file;
      config.elevations_deg = one.angles.elevations_deg;
      config.azimuths_deg = one.angles.azimuths_deg;
      // Most files have 0 for all, also where the maker's manual has centimetres: they know nothing of the offsets.
      const bool has_offsets = std::ranges::any_of(one.vertical_offset_mm, [](double offset) { return offset != 0; });
      config.vertical_offsets_mm = has_offsets ? one.vertical_offset_mm : std::vector<double>();
    }
    return used;
  }

  const std::string path_;
  std::uint64_t positions_ = 0;  // position packets before a scanner was recognised
  bool has_data_ = false, has_hdl64e_ = false;
  std::vector<VelodyneCalibration> given_;
  std::map<std::string, std::string> not_used_;             // by file: why
  std::set<std::pair<std::string, std::uint8_t>> unknown_;  // sender, factory byte
  /// By sender and factory byte of which no other packets came: the return mode of the first.
  std::map<std::pair<std::string, std::uint8_t>, std::uint8_t> modes_;
};

}  // namespace

std::unique_ptr<CaptureListener> listen_for_velodyne(const std::string& path) {
  return std::make_unique<VelodyneListener>(path);
}

}  // namespace hueline::drivers
