#include "tests/runtime/toy_scanner/toy_scanner.hpp"

#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "drivers/transport/file_source.hpp"

namespace hueline::toy {
namespace {

constexpr std::size_t kHeadBytes = 12, kPointBytes = 12;

class ToyDecoder final : public Decoder {
 public:
  explicit ToyDecoder(double min_range_m) : min_range_m_(min_range_m) {}

  void decode(const Packet& packet, std::vector<Measurement>& out) override {
    const auto bytes = packet.bytes.bytes();
    if (bytes.size() < kHeadBytes || (bytes.size() - kHeadBytes) % kPointBytes != 0 ||
        std::memcmp(bytes.data(), "TOY", 3) != 0) {
      counts_.malformed_bytes += bytes.size();
      ++counts_.malformed_messages;
      out.push_back(Fault{packet.sensor, FaultKind::Malformed, packet.received, 1, "not a packet of a toy scanner"});
      return;
    }
    counts_.decoded_bytes += bytes.size();
    std::int64_t time_ns = 0;
    std::memcpy(&time_ns, bytes.data() + 4, sizeof(time_ns));
    const GpsTime time = gps_time_ns(time_ns);
    if (bytes[3] == std::byte{'S'}) {
      ++counts_.of("status");
      out.push_back(LaserStatus{packet.sensor, packet.received, time, SyncState::Locked, "locked"});
      out.push_back(
          TimeLabel{packet.sensor, packet.received, std::chrono::floor<std::chrono::seconds>(time), {}, true});
      return;
    }
    ++counts_.of("data");
    LaserBatch batch{packet.sensor, packet.received, packet.sequence, time, {}};
    for (std::size_t at = kHeadBytes; at < bytes.size(); at += kPointBytes) {
      LaserReturn one;
      std::memcpy(&one.x, bytes.data() + at, 4);
      std::memcpy(&one.y, bytes.data() + at + 4, 4);
      std::memcpy(&one.z, bytes.data() + at + 8, 4);
      one.range_m = std::hypot(one.x, one.y, one.z);
      if (one.range_m >= static_cast<float>(min_range_m_)) batch.returns.push_back(one);
    }
    out.push_back(std::move(batch));
  }
  void reset() override {}
  const DecodeCounts& counts() const override { return counts_; }

 private:
  const double min_range_m_;
  DecodeCounts counts_;
};

class ToyScanner final : public drivers::Device {
 public:
  void visit(Keys& keys) override {
    keys.text(required("file", "", "What the scanner wrote."), file_);
    keys.number({"min_range_m", "m", "Nearer returns are dropped."}, min_range_m_, {0, 100});
  }
  KeyError validate() const override { return check_keys(*this); }
  drivers::Arrivals arrivals() const override { return drivers::Arrivals::Recorded; }
  std::unique_ptr<PacketSource> make_source(const BufferPool&) const override {
    drivers::FileSource::Config file;
    file.path = file_;
    return std::make_unique<drivers::FileSource>(file);
  }
  std::unique_ptr<Decoder> make_decoder() const override { return std::make_unique<ToyDecoder>(min_range_m_); }

 private:
  std::string file_;
  double min_range_m_ = 0.5;
};

bool begins_as_ours(std::string_view bytes) { return bytes.starts_with("TOY"); }

class ToyListener final : public drivers::CaptureListener {
 public:
  std::optional<drivers::HeardDevice> listen(const Packet& datagram, const std::string&) override {
    if (!is_decodable(datagram)) return {};
    return drivers::HeardDevice{"toy scanner", std::make_unique<ToyDecoder>(0)};
  }
  bool is_decodable(const Packet& datagram) const override {
    const auto bytes = datagram.bytes.bytes();
    return begins_as_ours({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
};
std::unique_ptr<drivers::CaptureListener> listen(const std::string&) { return std::make_unique<ToyListener>(); }

}  // namespace

constinit const drivers::DeviceType kToyScanner{
    .word = "toy_scanner",
    .role = drivers::Role::Laser,
    .is_sheddable = true,
    .make = drivers::make_device<ToyScanner>,
    .files = {.log = {.format = "toy scanner", .ending = ".toy", .is_beginning = begins_as_ours},
              .capture = {.kind = "a toy scanner", .has_signature = true, .listen = listen}}};

std::vector<std::byte> encode(char kind, GpsTime time, std::span<const std::array<float, 3>> points) {
  std::vector<std::byte> out(kHeadBytes + points.size() * kPointBytes);
  const std::int64_t time_ns = count_ns(time);
  std::memcpy(out.data(), "TOY", 3);
  out[3] = static_cast<std::byte>(kind);
  std::memcpy(out.data() + 4, &time_ns, sizeof(time_ns));
  if (!points.empty()) std::memcpy(out.data() + kHeadBytes, points.data(), points.size() * kPointBytes);
  return out;
}

}  // namespace hueline::toy
