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

/// Reads the file and calls `take` for the measurements of each device, which has the same number in every reading.
Result<DecodedCapture> read_capture(const DecodeOptions& options, CaptureDevices& devices, const Take& take) {
  DecodedCapture out;
  drivers::PcapSource source(
      {.path = options.capture, .ports = {}, .source_address = {}, .protocol = drivers::PcapSource::Protocol::All});
  if (Status opened = source.open(); !opened.ok()) return opened.error();
  std::uint64_t packets = 0;
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
      ++packets;
    }
    measured.clear();
    if (const CaptureDevice* device = devices.take(*packet, source, measured)) take(number_of(*device), measured);
  }
  devices.finish([&](const CaptureDevice& device, std::vector<Measurement>& last) { take(number_of(device), last); });
  if (devices.devices().empty()) {
    if (!out.trouble.ok() && packets == 0) return out.trouble.error();
    return Error{ErrorCode::Unsupported,
                 fmt::format("{}: not supported: {}", options.capture, devices.why_undecoded(packets))};
  }
  return out;
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

Result<DecodedCapture> decode_capture(const DecodeOptions& options, drivers::DeviceTypes types) {
  CaptureDevices first(options.capture, types);
  for (const std::string& file : options.descriptions)
    if (Status used = first.use_description(file); !used.ok()) return used.error();
  std::map<std::size_t, Learnt> learnt;
  const auto seen = read_capture(options, first, [&](std::size_t device, const std::vector<Measurement>& measured) {
    learnt[device].learn(measured);
  });
  if (!seen.ok()) return seen.error();

  const auto scanners = std::ranges::count_if(learnt, [](const auto& one) { return one.second.is_scanner; });
  std::map<std::size_t, ScannerCloud> clouds;
  for (const auto& [number, known] : learnt) {
    if (!known.is_scanner) continue;
    const CaptureDevice& device = first.devices()[number];
    DecodedScanner scanner;
    scanner.name = device.name;
    scanner.note = device.note;
    scanner.address = drivers::to_text(device.address);
    scanner.cloud = scanners == 1 ? options.out : name_beside(options.out, device, first.devices());
    clouds.emplace(number, ScannerCloud(std::move(scanner), CloudClock(known, options)));
  }
  CaptureDevices second(options.capture, types);
  for (const std::string& file : options.descriptions)
    if (Status used = second.use_description(file); !used.ok()) return used.error();
  auto out = read_capture(options, second, [&](std::size_t device, const std::vector<Measurement>& measured) {
    if (const auto cloud = clouds.find(device); cloud != clouds.end()) cloud->second.take(measured);
  });
  if (!out.ok()) return out.error();
  for (auto& [number, cloud] : clouds) {
    if (Status closed = cloud.close(); !closed.ok() && out->written.ok()) out->written = closed;
    out->scanners.push_back(cloud.scanner());
  }
  out->not_supported = not_supported(second);
  return out;
}

}  // namespace hueline::apps
