#include "apps/inspect/capture_devices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <span>

namespace hueline::apps {
namespace {

/// A capture of a vehicle has a handful; one of a whole network is not for us.
constexpr std::size_t kMostDevices = 64, kMostStrangers = 64, kMostStreams = 256;
/// As `inspect` reads of a file of one device's bytes to recognise it.
constexpr std::size_t kBeginningBytes = 64 << 10;

}  // namespace

CaptureDevices::CaptureDevices(const std::string& path, drivers::DeviceTypes types) : types_(types) {
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

std::string CaptureDevices::why_not_used(const std::string& file) const {
  std::string out;
  for (const Listening& one : listening_)
    if (const std::string why = one.listener->why_not_used(file); !why.empty()) out += (out.empty() ? "" : "; ") + why;
  return out;
}

const drivers::CaptureListener& CaptureDevices::listener_of(const drivers::DeviceType* type) const {
  return *std::ranges::find(listening_, type, &Listening::type)->listener;
}

CaptureDevice* CaptureDevices::recognise(const Packet& datagram, const drivers::PcapSource& source,
                                         const drivers::DeviceType* only) {
  if (devices_.size() >= kMostDevices) return nullptr;
  for (const Listening& one : listening_) {
    if (only && one.type != only) continue;
    auto heard = one.listener->listen(datagram, drivers::to_text(source.sender()));
    if (!heard) continue;
    return &devices_.emplace_back(CaptureDevice{one.type,
                                                std::move(heard->name),
                                                source.sender(),
                                                source.sender_card(),
                                                source.destination_port(),
                                                {},
                                                std::move(heard->decoder),
                                                std::move(heard->note),
                                                std::move(heard->description)});
  }
  return nullptr;
}

CaptureDevice* CaptureDevices::find(const Packet& datagram, const drivers::PcapSource& source,
                                    std::vector<Measurement>& out) {
  const drivers::IpAddress& sender = source.sender();
  const std::uint16_t port = source.destination_port();
  CaptureDevice* elsewhere = nullptr;  // reads such datagrams, but was recognised at another port
  for (CaptureDevice& device : devices_) {
    if (device.stream || device.address != sender || device.card != source.sender_card()) continue;
    if (!listener_of(device.type).is_decodable(datagram)) continue;
    if (device.port == port) return &device;
    if (!elsewhere) elsewhere = &device;
  }
  // A datagram by which a device is recognised makes one for its port; any other, such as a status that has a port of
  // its own, belongs to the device that is known.
  if (CaptureDevice* found = recognise(datagram, source, elsewhere ? elsewhere->type : nullptr)) {
    decode_what_came_before(*found, out);
    return found;
  }
  if (elsewhere) return elsewhere;
  Stranger* stranger = count_stranger(datagram, sender, port);
  if (stranger && stranger->first_bytes + datagram.bytes.size() <= kBeginningBytes) {
    stranger->first.emplace_back(source.sender_card(), datagram);
    stranger->first_bytes += datagram.bytes.size();
  }
  return nullptr;
}

void CaptureDevices::decode_what_came_before(CaptureDevice& device, std::vector<Measurement>& out) {
  const drivers::CaptureListener& listener = listener_of(device.type);
  for (auto it = strangers_.begin(); it != strangers_.end();) {
    Stranger& stranger = it->second;
    if (it->first.first != device.address || stranger.first.empty()) {
      ++it;
      continue;
    }
    const auto its_own = std::erase_if(stranger.first, [&](const auto& one) {
      const auto& [card, packet] = one;
      if (card != device.card || !listener.is_decodable(packet)) return false;
      device.decoder->decode(packet, out);
      --stranger.datagrams;
      stranger.bytes -= packet.bytes.size();
      return true;
    });
    // Those that were not kept are like those that were.
    const bool are_all_its_own = its_own > 0 && stranger.first.empty();
    it = are_all_its_own ? strangers_.erase(it) : std::next(it);
  }
}

CaptureDevices::Stranger* CaptureDevices::count_stranger(const Packet& packet, const drivers::IpAddress& sender,
                                                         std::uint16_t port) {
  auto stranger = strangers_.find({sender, port});
  if (stranger == strangers_.end() && strangers_.size() < kMostStrangers)
    stranger = strangers_.emplace(std::pair(sender, port), Stranger{}).first;
  if (stranger == strangers_.end()) return nullptr;
  ++stranger->second.datagrams;
  stranger->second.bytes += packet.bytes.size();
  return &stranger->second;
}

CaptureDevice* CaptureDevices::find(const drivers::TcpFlow& stream) {
  const auto known = std::ranges::find(devices_, stream, &CaptureDevice::stream);
  return known == devices_.end() ? nullptr : &*known;
}

/// Recognises a device from the beginning of its stream, as `inspect` recognises a file of its bytes.
CaptureDevice* CaptureDevices::recognise(const drivers::TcpFlow& stream, Unknown& unknown) {
  if (devices_.size() >= kMostDevices || unknown.bytes == unknown.judged_bytes) return nullptr;
  unknown.judged_bytes = unknown.bytes;
  std::string beginning;
  for (const Packet& packet : unknown.packets)
    beginning.append(reinterpret_cast<const char*>(packet.bytes.bytes().data()), packet.bytes.size());
  for (const drivers::DeviceType* type : types_) {
    const drivers::DeviceFiles::Log& log = type->files.log;
    if (!log.is_beginning || !log.is_beginning(beginning)) continue;
    return &devices_.emplace_back(CaptureDevice{type,
                                                fmt::format("{} ({}), by TCP", type->word, log.format),
                                                stream.source,
                                                {},
                                                stream.source_port,
                                                stream,
                                                type->make()->make_decoder(),
                                                {},
                                                {}});
  }
  return nullptr;
}

CaptureDevice* CaptureDevices::take_stream(const Packet& packet, const drivers::TcpFlow& stream,
                                           std::vector<Measurement>& out) {
  if (CaptureDevice* known = find(stream)) {
    if (packet.kind == PacketKind::Wire) {
      known->decoder->decode(packet, out);
    } else if (const auto fault = decode_fault(packet.sensor, packet.received, packet.bytes.bytes());
               fault.ok() && fault->kind == FaultKind::Disconnected) {
      known->decoder->flush(out);
      known->decoder->reset();
    }
    return known;
  }
  if (stream.source_port > stream.destination_port) return nullptr;  // what a computer asks the device for
  if (packet.kind != PacketKind::Wire) {
    unknown_.erase(stream);  // what follows is not the continuation
    return nullptr;
  }
  count_stranger(packet, stream.source, stream.source_port);
  if (!unknown_.contains(stream) && unknown_.size() >= kMostStreams) return nullptr;
  Unknown& unknown = unknown_[stream];
  if (unknown.is_given_up) return nullptr;
  unknown.packets.push_back(packet);
  unknown.bytes += packet.bytes.size();
  // Judged anew only when it has doubled, so that the work is in proportion to the bytes.
  const bool is_enough = unknown.bytes >= kBeginningBytes;
  if (!is_enough && unknown.bytes < 2 * unknown.judged_bytes) return nullptr;
  CaptureDevice* device = recognise(stream, unknown);
  if (device) {
    for (const Packet& held : unknown.packets) device->decoder->decode(held, out);
    unknown_.erase(stream);
    strangers_.erase({stream.source, stream.source_port});
  } else if (is_enough) {
    unknown = {.packets = {}, .bytes = 0, .judged_bytes = 0, .is_given_up = true};
  }
  return device;
}

CaptureDevice* CaptureDevices::take(const Packet& packet, const drivers::PcapSource& source,
                                    std::vector<Measurement>& out) {
  if (const auto& stream = source.flow()) return take_stream(packet, *stream, out);
  if (packet.kind != PacketKind::Wire) return nullptr;
  CaptureDevice* device = find(packet, source, out);
  if (device) device->decoder->decode(packet, out);
  return device;
}

void CaptureDevices::finish(const std::function<void(CaptureDevice&, std::vector<Measurement>&)>& take) {
  std::map<const CaptureDevice*, std::vector<Measurement>> late;
  for (auto& [stream, unknown] : unknown_)
    if (CaptureDevice* device = recognise(stream, unknown)) {
      for (const Packet& held : unknown.packets) device->decoder->decode(held, late[device]);
      strangers_.erase({stream.source, stream.source_port});
    }
  unknown_.clear();
  for (CaptureDevice& device : devices_) {
    std::vector<Measurement>& measured = late[&device];
    device.decoder->flush(measured);
    take(device, measured);
  }
}

std::string CaptureDevices::unknown_models() const {
  std::string out;
  for (const Listening& one : listening_)
    if (const std::string models = one.listener->unknown_models(); !models.empty())
      out += (out.empty() ? "" : "; ") + models;
  return out;
}

std::string CaptureDevices::lone_packets() const {
  std::string out;
  for (const Listening& one : listening_)
    if (const std::string lone = one.listener->lone_packets(); !lone.empty()) out += (out.empty() ? "" : "; ") + lone;
  return out;
}

std::string CaptureDevices::why_undecoded(std::uint64_t packets) const {
  if (packets == 0) return "holds neither UDP datagrams nor TCP streams";
  // A few packets of something else may look like those of a device: the others say what the capture is.
  const std::string in_all = ". In all: " + strangers_in_words();
  if (const std::string unknown = unknown_models(); !unknown.empty())
    return unknown + ": it is counted, not decoded" + in_all;
  if (const std::string lone = lone_packets(); !lone.empty()) return lone + ": they are counted, not decoded" + in_all;
  std::string kinds, streams;
  for (const Listening& one : listening_)
    kinds += (kinds.empty() ? "" : " or ") + std::string(one.type->files.capture.kind);
  for (const drivers::DeviceType* type : types_)
    if (type->files.log.is_beginning) streams += (streams.empty() ? "" : ", ") + std::string(type->files.log.format);
  return fmt::format(
      "none of its datagrams is one of {}, and none of its TCP streams begins as {}: they are counted, not decoded. It "
      "holds {}",
      kinds, streams, strangers_in_words());
}

std::string CaptureDevices::strangers_in_words() const {
  constexpr std::size_t kMostNamed = 4;
  std::vector<const Strangers::value_type*> senders;
  for (const auto& one : strangers_) senders.push_back(&one);
  std::ranges::stable_sort(senders, std::ranges::greater(), [](const auto* one) { return one->second.bytes; });
  std::string out;
  for (const auto* one : std::span(senders).first(std::min(kMostNamed, senders.size())))
    out += fmt::format("{}{} {} of {} bytes on average from {}, port {}", out.empty() ? "" : "; ",
                       one->second.datagrams, one->second.datagrams == 1 ? "packet" : "packets",
                       one->second.bytes / std::max<std::uint64_t>(1, one->second.datagrams),
                       drivers::to_text(one->first.first), one->first.second);
  if (senders.size() > kMostNamed) out += fmt::format("; and those of {} more senders", senders.size() - kMostNamed);
  return out.empty() ? "no packet with content" : out;
}

}  // namespace hueline::apps
