#include "apps/decode/decode_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <utility>

#include "apps/decode/scanner_cloud.hpp"
#include "apps/inspect/capture_devices.hpp"
#include "drivers/transport/pcap_source.hpp"

namespace hueline::apps {
namespace {

/// A sender of at least so many datagrams that are so large on average may be a scanner.
constexpr std::uint64_t kLeastDatagrams = 20, kLeastMeanBytes = 200;

using Take = std::function<void(std::size_t device, std::vector<Measurement>&)>;

/// What came of one reading of a file.
struct Reading {
  std::uint64_t packets = 0;
  Status trouble;  ///< why the file was read in part or not at all
};

/// Reads the file and calls `take` for the measurements of each device, which has the same number in every reading.
Result<Reading> read_capture(const std::string& capture, CaptureDevices& devices, const Take& take) {
  Reading out;
  drivers::PcapSource source(
      {.path = capture, .ports = {}, .source_address = {}, .protocol = drivers::PcapSource::Protocol::All});
  if (Status opened = source.open(); !opened.ok()) return opened.error();
  std::vector<Measurement> measured;
  std::map<const CaptureDevice*, std::size_t> numbers;
  const auto number_of = [&](const CaptureDevice& device) {
    return numbers.emplace(&device, numbers.size()).first->second;
  };
  for (;;) {
    Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      if (packet.error().code == ErrorCode::EndOfData) break;
      if (out.trouble.ok()) out.trouble = packet.error();
      continue;
    }
    if (packet->kind == PacketKind::Fault) {
      const auto fault = decode_fault(1, packet->received, packet->bytes.bytes());
      const bool is_loss =
          fault.ok() && (fault->kind == FaultKind::Malformed || fault->kind == FaultKind::Disconnected);
      if (is_loss && out.trouble.ok()) out.trouble = Error{ErrorCode::Malformed, fault->detail};
    } else {
      ++out.packets;
    }
    measured.clear();
    if (const CaptureDevice* device = devices.take(*packet, source, measured)) take(number_of(*device), measured);
  }
  devices.finish([&](const CaptureDevice& device, std::vector<Measurement>& last) { take(number_of(device), last); });
  return out;
}

Status use_descriptions(CaptureDevices& devices, const DecodeOptions& options) {
  for (const std::string& file : options.descriptions)
    if (Status used = devices.use_description(file); !used.ok()) return used;
  return {};
}

/// The name of a scanner's cloud beside those of other scanners.
std::filesystem::path name_beside(const std::filesystem::path& out, const CaptureDevice& device,
                                  const std::deque<CaptureDevice>& all) {
  std::string tail = "-" + drivers::to_text(device.address);
  std::ranges::replace(tail, ':', '_');
  const auto at_address =
      std::ranges::count_if(all, [&](const CaptureDevice& other) { return other.address == device.address; });
  if (at_address > 1) tail += fmt::format("-{}", device.port);
  const auto same = std::ranges::count_if(all, [&](const CaptureDevice& other) {
    return &other < &device && other.address == device.address && other.port == device.port;
  });
  if (same > 0) tail += fmt::format("-{}", same + 1);
  return std::filesystem::path(out).replace_filename(out.stem().string() + tail + out.extension().string());
}

std::vector<std::string> not_supported(const CaptureDevices& devices) {
  std::vector<std::string> out;
  if (const std::string unknown = devices.unknown_models(); !unknown.empty()) out.push_back(unknown);
  for (const auto& [from, sent] : devices.strangers()) {
    const auto& [address, port] = from;
    if (sent.datagrams >= kLeastDatagrams && sent.bytes / sent.datagrams >= kLeastMeanBytes)
      out.push_back(fmt::format("{} packets of {} bytes on average from {}, port {}: of no device that is known",
                                sent.datagrams, sent.bytes / sent.datagrams, drivers::to_text(address), port));
  }
  return out;
}

}  // namespace

struct KnownCapture::State {
  State(DecodeOptions what, drivers::DeviceTypes of)
      : options(std::move(what)), types(of), devices(options.capture, types) {}
  DecodeOptions options;
  drivers::DeviceTypes types;
  CaptureDevices devices;
  std::map<std::size_t, Learnt> learnt;
  Reading reading;
};

KnownCapture::KnownCapture(std::unique_ptr<State> state) : state_(std::move(state)) {}
KnownCapture::KnownCapture(KnownCapture&&) noexcept = default;
KnownCapture::~KnownCapture() = default;

Result<KnownCapture> KnownCapture::learn(const DecodeOptions& options, drivers::DeviceTypes types) {
  auto state = std::make_unique<State>(options, types);
  if (Status used = use_descriptions(state->devices, options); !used.ok()) return used.error();
  auto read = read_capture(
      options.capture, state->devices,
      [&](std::size_t device, const std::vector<Measurement>& measured) { state->learnt[device].learn(measured); });
  if (!read.ok()) return read.error();
  state->reading = std::move(*read);
  const bool is_unread = state->devices.devices().empty() && state->reading.packets == 0;
  if (is_unread && !state->reading.trouble.ok()) return state->reading.trouble.error();
  return KnownCapture(std::move(state));
}

std::size_t KnownCapture::scanners() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(state_->learnt, [](const auto& one) { return one.second.is_scanner; }));
}

bool KnownCapture::has_devices() const { return !state_->devices.devices().empty(); }

std::string KnownCapture::why_none() const {
  // What was not delivered may be why nothing is known.
  const Status& trouble = state_->reading.trouble;
  return state_->devices.why_undecoded(state_->reading.packets) + (trouble.ok() ? "" : ". " + trouble.error().message);
}

std::string KnownCapture::why_none_of_topic() const {
  constexpr const char* kNone = "of no scanner that is known: ";
  if (const std::string models = state_->devices.unknown_models(); !models.empty()) return kNone + models;
  if (std::string lone = state_->devices.lone_packets(); !lone.empty()) return lone;
  std::uint64_t datagrams = 0, bytes = 0;
  for (const auto& [from, sent] : state_->devices.strangers()) datagrams += sent.datagrams, bytes += sent.bytes;
  return fmt::format("{}{} packets of {} bytes on average", kNone, datagrams,
                     bytes / std::max<std::uint64_t>(1, datagrams));
}

bool KnownCapture::has_unknown_scanner() const { return !not_supported(state_->devices).empty(); }

Result<DecodedCapture> KnownCapture::write(const std::filesystem::path& out) {
  const DecodeOptions& options = state_->options;
  const std::size_t count = scanners();
  std::map<std::size_t, ScannerCloud> clouds;
  for (const auto& [number, known] : state_->learnt) {
    const std::deque<CaptureDevice>& devices = state_->devices.devices();
    const CaptureDevice& device = devices[number];
    // One that gives no point is told with its faults.
    if (!known.is_scanner && device.type->role != drivers::Role::Laser) continue;
    DecodedScanner scanner;
    scanner.name = device.name;
    scanner.note = device.note;
    scanner.address = drivers::to_text(device.address);
    const bool has_twin = std::ranges::any_of(devices, [&](const CaptureDevice& other) {
      return other.address == device.address && other.card != device.card;
    });
    if (has_twin) scanner.address += ", network card " + drivers::to_text(device.card);
    scanner.cloud = count <= 1 ? out : name_beside(out, device, devices);
    clouds.emplace(number, ScannerCloud(std::move(scanner), CloudClock(known, options)));
  }
  CaptureDevices again(options.capture, state_->types);
  if (Status used = use_descriptions(again, options); !used.ok()) return used.error();
  auto read = read_capture(options.capture, again, [&](std::size_t device, const std::vector<Measurement>& measured) {
    if (const auto cloud = clouds.find(device); cloud != clouds.end()) cloud->second.take(measured);
  });
  if (!read.ok()) return read.error();
  DecodedCapture decoded;
  decoded.trouble = read->trouble;
  for (auto& [number, cloud] : clouds) {
    if (Status closed = cloud.close(); !closed.ok() && decoded.written.ok()) decoded.written = closed;
    decoded.scanners.push_back(cloud.scanner());
  }
  decoded.not_supported = not_supported(again);
  for (const CaptureDevice& device : again.devices())
    if (!device.description.empty()) decoded.used_descriptions.insert(device.description);
  for (const std::string& file : options.descriptions)
    if (std::string why = again.why_not_used(file); !why.empty())
      decoded.refused_descriptions.emplace(file, std::move(why));
  return decoded;
}

Result<DecodedCapture> decode_capture(const DecodeOptions& options, drivers::DeviceTypes types) {
  auto known = KnownCapture::learn(options, types);
  if (!known.ok()) return known.error();
  if (!known->has_devices())
    return Error{ErrorCode::Unsupported, fmt::format("{}: not supported: {}", options.capture, known->why_none())};
  return known->write(options.out);
}

}  // namespace hueline::apps
