#include "drivers/transport/pcap_source.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace hueline::drivers {

std::string PcapSource::Config::validate() const {
  if (path.empty()) return "path must name a pcap or pcapng file";
  if (!source_address.empty() && !parse_ip_address(source_address))
    return fmt::format("source_address '{}' is neither an IPv4 nor an IPv6 address", source_address);
  return {};
}

Status PcapSource::open() {
  close();
  if (const std::string wrong = config_.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  source_ = config_.source_address.empty() ? std::nullopt : parse_ip_address(config_.source_address);
  Result<CaptureFile> file = CaptureFile::open(config_.path);
  if (!file) return file.error();
  file_.emplace(std::move(file).value());
  extractor_ = {};
  ended_.reset();
  last_ = {};
  filtered_ = 0;
  return {};
}

bool PcapSource::is_wanted(const UdpDatagram& datagram) const {
  if (source_ && datagram.source != *source_) return false;
  return config_.ports.empty() ||
         std::find(config_.ports.begin(), config_.ports.end(), datagram.destination_port) != config_.ports.end();
}

Result<Packet> PcapSource::next(std::stop_token stop) {
  const Error over{ErrorCode::EndOfData, config_.path + ": end of capture"};
  if (ended_) return std::exchange(*ended_, over);
  if (!file_) return Error{ErrorCode::Disconnected, "capture " + config_.path + " is not open"};
  for (;;) {
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    Result<CaptureFrame> frame = file_->next();
    if (!frame) return finish(frame.error());
    const HostTime time(frame->time);
    if (count_ns(time) != 0) last_ = time;  // pcapng's simple blocks have no time: that of the frame before
    const std::optional<UdpDatagram> datagram = extractor_.extract(*frame);
    if (!datagram) continue;
    if (!is_wanted(*datagram)) {
      ++filtered_;
      continue;
    }
    Packet packet;
    packet.sensor = sensor_;
    packet.received = last_;
    packet.bytes = Buffer::copy_of(datagram->payload);
    return packet;
  }
}

/// What could not be delivered is said once, before the end.
Result<Packet> PcapSource::finish(Error why) {
  extractor_.finish();
  const ExtractCounts& c = extractor_.counts();
  const std::uint64_t lost = c.cut_off + c.malformed + c.fragments_dropped + c.unknown_link;
  if (lost == 0) {
    ended_ = Error{ErrorCode::EndOfData, config_.path + ": end of capture"};
    return why;
  }
  ended_ = std::move(why);
  Fault fault{sensor_, FaultKind::Malformed, last_, lost,
              fmt::format("{}: frames not delivered: {} cut off by the capture, {} with broken headers, {} fragments of "
                          "datagrams that are not whole, {} of a link type that is not read",
                          config_.path, c.cut_off, c.malformed, c.fragments_dropped, c.unknown_link)};
  Packet packet;
  packet.sensor = sensor_;
  packet.kind = PacketKind::Fault;
  packet.received = last_;
  packet.bytes = Buffer::copy_of(encode_fault(fault));
  return packet;
}

}  // namespace hueline::drivers
