#include "apps/inspect/capture_devices.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace hueline::apps {
namespace {

/// A capture of a vehicle has a handful; one of a whole network is not for us.
constexpr std::size_t kMostDevices = 64, kMostStrangers = 64;

}  // namespace

CaptureDevices::CaptureDevices(const std::string& path, drivers::DeviceTypes types) {
  for (const bool has_signature : {true, false})
    for (const drivers::DeviceType* type : types)
      if (const auto& capture = type->files.capture; capture.listen && capture.has_signature == has_signature)
        listening_.push_back({type, capture.listen(path)});
}

Status CaptureDevices::use_description(const std::string& file) {
  Status refused = Error{ErrorCode::Unsupported, file + ": describes no device that is known"};
  bool is_known = false;
  for (const Listening& one : listening_) {
    Status taken = one.listener->use_description(file);
    is_known |= taken.ok();
    if (!taken.ok() && taken.error().code != ErrorCode::Unsupported) refused = std::move(taken);
  }
  return is_known ? Status() : refused;
}

const drivers::CaptureListener& CaptureDevices::listener_of(const drivers::DeviceType* type) const {
  return *std::ranges::find(listening_, type, &Listening::type)->listener;
}

CaptureDevice* CaptureDevices::recognise(const Packet& datagram, const drivers::IpAddress& sender, std::uint16_t port,
                                         const drivers::DeviceType* only) {
  if (devices_.size() >= kMostDevices) return nullptr;
  for (const Listening& one : listening_) {
    if (only && one.type != only) continue;
    auto heard = one.listener->listen(datagram, drivers::to_text(sender));
    if (!heard) continue;
    return &devices_.emplace_back(CaptureDevice{one.type, std::move(heard->name), sender, port,
                                                std::move(heard->decoder), std::move(heard->note)});
  }
  return nullptr;
}

CaptureDevice* CaptureDevices::find(const Packet& datagram, const drivers::IpAddress& sender, std::uint16_t port) {
  CaptureDevice* elsewhere = nullptr;  // reads such datagrams, but was recognised at another port
  for (CaptureDevice& device : devices_) {
    if (device.address != sender || !listener_of(device.type).is_decodable(datagram)) continue;
    if (device.port == port) return &device;
    if (!elsewhere) elsewhere = &device;
  }
  // A datagram by which a device is recognised makes one for its port; any other, such as a status that has a port of
  // its own, belongs to the device that is known.
  if (CaptureDevice* found = recognise(datagram, sender, port, elsewhere ? elsewhere->type : nullptr)) return found;
  if (elsewhere) return elsewhere;
  auto stranger = strangers_.find({sender, port});
  if (stranger == strangers_.end() && strangers_.size() < kMostStrangers)
    stranger = strangers_.emplace(std::pair(sender, port), Stranger{}).first;
  if (stranger == strangers_.end()) return nullptr;
  ++stranger->second.datagrams;
  stranger->second.bytes += datagram.bytes.size();
  return nullptr;
}

std::string CaptureDevices::unknown_models() const {
  std::string out;
  for (const Listening& one : listening_)
    if (const std::string models = one.listener->unknown_models(); !models.empty())
      out += (out.empty() ? "" : "; ") + models;
  return out;
}

std::string CaptureDevices::why_undecoded(std::uint64_t datagrams) const {
  if (datagrams == 0) return "holds no UDP datagram: devices are read from UDP alone";
  std::string kinds;
  for (const Listening& one : listening_)
    kinds += (kinds.empty() ? "" : " or ") + std::string(one.type->files.capture.kind);
  if (const std::string unknown = unknown_models(); !unknown.empty()) return unknown + ": it is counted, not decoded";
  return fmt::format("none of its datagrams is one of {}: they are counted, not decoded", kinds);
}

}  // namespace hueline::apps
