#include "drivers/transport/pcap_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hueline::drivers {
namespace {

constexpr std::size_t kMostOthers = 16;

/// After so long a silence the device may have been replaced or have got another address: the next sender counts as the
/// first one.
constexpr nanoseconds kReplacedAfter = std::chrono::seconds(3);

}  // namespace

void PcapSource::Config::visit(Keys& keys) {
  static const TextForm address{"an IPv4 or IPv6 address",
                                [](const std::string& text) { return parse_ip_address(text).has_value(); }};
  keys.text(required("file", "",
                     "A pcap or pcapng file. It is read as fast as it can be recorded, and is refused beside sensors "
                     "that are devices."),
            path);
  keys.wholes({"ports", "", "The destination ports of the datagrams to read.", "all"}, ports, {1, 65535});
  keys.text({"source_address", "", "The address of the device whose datagrams are read.", "all"}, source_address,
            address);
}

KeyError PcapSource::Config::validate() const {
  if (path.empty()) return not_allowed("file", "empty", "a pcap or pcapng file");
  return check_keys(*this);
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
  first_sender_.reset();
  waiting_.clear();
  last_ = {};
  filtered_ = delivered_ = 0;
  other_ports_.clear();
  other_sources_.clear();
  return {};
}

bool PcapSource::is_wanted(const UdpDatagram& datagram) const {
  if (source_ && datagram.source != *source_) return false;
  return config_.ports.empty() ||
         std::find(config_.ports.begin(), config_.ports.end(), datagram.destination_port) != config_.ports.end();
}

/// Reports a second sender. Scanners send to the same port unless they are set otherwise; two scanners taken for one
/// would give one wrong cloud.
void PcapSource::watch_sender(const UdpDatagram& datagram) {
  sender_ = datagram.source;
  if (!first_sender_ || last_ - first_heard_ > kReplacedAfter) first_sender_ = sender_;
  if (source_ || sender_ == *first_sender_) {
    first_heard_ = last_;
    return;
  }
  tell(FaultKind::WrongDevice, 1,
       fmt::format("{}: datagrams of {} and of {} are taken for one device's: name its source_address, or its ports",
                   config_.path, to_text(*first_sender_), to_text(sender_)));
}

void PcapSource::tell(FaultKind kind, std::uint64_t count, std::string detail) {
  waiting_.push_back(fault_packet(last_, kind, count, std::move(detail)));
}

Result<Packet> PcapSource::next(std::stop_token stop) {
  for (;;) {
    if (!waiting_.empty()) {
      Packet packet = std::move(waiting_.front());
      waiting_.pop_front();
      return packet;
    }
    if (ended_) return std::exchange(*ended_, Error{ErrorCode::EndOfData, config_.path + ": end of capture"});
    if (!file_) return Error{ErrorCode::Disconnected, "capture " + config_.path + " is not open"};
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    Result<CaptureFrame> frame = file_->next();
    if (!frame) {
      finish(frame.error());
      continue;
    }
    const HostTime time(frame->time);
    // pcapng's simple packet blocks have no time; they get the time of the frame before.
    if (count_ns(time) != 0) last_ = time;
    const std::optional<UdpDatagram> datagram = extractor_.extract(*frame);
    if (!datagram) continue;
    if (!is_wanted(*datagram)) {
      ++filtered_;
      if (other_ports_.size() < kMostOthers) ++other_ports_[datagram->destination_port];
      if (other_sources_.size() < kMostOthers) ++other_sources_[datagram->source];
      continue;
    }
    destination_port_ = datagram->destination_port;
    watch_sender(*datagram);
    Packet packet;
    packet.received = last_;
    packet.bytes = Buffer::copy_of(datagram->payload);
    ++delivered_;
    if (waiting_.empty()) return packet;
    waiting_.push_back(std::move(packet));
  }
}

/// Reports what could not be delivered, once, before the end.
void PcapSource::finish(Error why) {
  ended_ = std::move(why);
  extractor_.finish();
  const ExtractCounts& c = extractor_.counts();
  if (const std::uint64_t lost = c.cut_off + c.malformed + c.fragments_dropped + c.unknown_link; lost > 0)
    tell(FaultKind::Malformed, lost,
         fmt::format("{}: frames not delivered: {} cut off by the capture, {} with broken headers, {} fragments of "
                     "datagrams that are not whole, {} of "
                     "a link type that is not read{}",
                     config_.path, c.cut_off, c.malformed, c.fragments_dropped, c.unknown_link,
                     c.unknown_link > 0 ? fmt::format(" ({})", c.unknown_link_type) : std::string()));
  if (delivered_ == 0)
    tell(FaultKind::WrongDevice, std::max<std::uint64_t>(1, filtered_ + c.not_udp), config_.path + ": " + others());
}

/// Says in words what a capture without a datagram of the device holds instead.
std::string PcapSource::others() const {
  const ExtractCounts& c = extractor_.counts();
  if (filtered_ > 0) {
    std::string ports, sources;
    for (const auto& [port, count] : other_ports_)
      ports += fmt::format("{}{} ({})", ports.empty() ? "" : ", ", port, count);
    for (const auto& [source, count] : other_sources_)
      sources += fmt::format("{}{} ({})", sources.empty() ? "" : ", ", to_text(source), count);
    return fmt::format("no datagram of the rig's ports and address; there are datagrams to the ports {}, from {}",
                       ports, sources);
  }
  if (c.tcp > 0) return fmt::format("no UDP datagram; {} frames are of TCP connections, which are not read", c.tcp);
  if (c.not_udp > 0) return fmt::format("no UDP datagram; {} frames are of other protocols", c.not_udp);
  return "no UDP datagram";
}

}  // namespace hueline::drivers
