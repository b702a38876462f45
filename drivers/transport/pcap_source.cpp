#include "drivers/transport/pcap_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/transport/first_sender.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kMostOthers = 16;

}  // namespace

void PcapSource::Config::visit(Keys& keys) {
  static const TextForm address{"an IPv4 or IPv6 address",
                                [](const std::string& text) { return parse_ip_address(text).has_value(); }};
  keys.text(required("file", "",
                     "A pcap or pcapng file. It is read as fast as it can be recorded, and is refused beside sensors "
                     "that are devices."),
            path);
  keys.wholes(
      {"ports", "", "The destination ports of the datagrams to read; of a TCP connection, the device's port.", "all"},
      ports, {1, 65535});
  keys.text({"source_address", "", "The address of the device whose data are read.", "all"}, source_address, address);
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
  streams_ = {};
  read_.reset();
  ended_.reset();
  first_sender_.reset();
  flow_.reset();
  device_flow_.reset();
  told_flow_.reset();
  waiting_.clear();
  last_ = {};
  filtered_ = delivered_ = 0;
  other_ports_.clear();
  other_sources_.clear();
  return {};
}

bool PcapSource::is_wanted(const IpAddress& source, std::uint16_t port) const {
  if (source_ && source != *source_) return false;
  return config_.ports.empty() || std::find(config_.ports.begin(), config_.ports.end(), port) != config_.ports.end();
}

void PcapSource::skip(const IpAddress& source, std::uint16_t port) {
  ++filtered_;
  if (other_ports_.size() < kMostOthers) ++other_ports_[port];
  if (other_sources_.size() < kMostOthers) ++other_sources_[source];
}

void PcapSource::take(const UdpDatagram& datagram) {
  if (!is_wanted(datagram.source, datagram.destination_port)) return skip(datagram.source, datagram.destination_port);
  flow_.reset();
  destination_port_ = datagram.destination_port;
  sender_ = datagram.source;
  sender_card_ = datagram.source_card;
  // With all protocols the reader tells devices apart itself, and the device may be one that sends by TCP.
  if (config_.protocol == Protocol::Udp) watch_sender();
  Packet packet;
  packet.received = last_;
  packet.bytes = Buffer::copy_of(datagram.payload);
  ++delivered_;
  waiting_.push_back(std::move(packet));
}

/// Decides whether a piece is of the device's stream. A device's new connection takes the place of its old one.
bool PcapSource::is_of_device(const TcpPiece& piece) {
  const TcpFlow& flow = piece.flow;
  const bool is_named = source_ || !config_.ports.empty();
  if (!is_wanted(flow.source, flow.source_port) || (!is_named && flow.source_port > flow.destination_port)) {
    skip(flow.source, flow.source_port);
    return false;
  }
  if (!device_flow_) device_flow_ = flow;
  if (flow == *device_flow_) return true;
  const bool is_same_device = flow.source == device_flow_->source && flow.source_port == device_flow_->source_port;
  if (is_same_device && (piece.is_beginning || piece.received - piece_heard_ > kReplacedAfter)) {
    tell(FaultKind::Disconnected, 1, fmt::format("{}: {} has a new connection", config_.path, to_text(flow.source)));
    tell(FaultKind::Reconnected, 1, "connected again");
    device_flow_ = flow;
    return true;
  }
  if (told_flow_ != flow)
    tell(FaultKind::WrongDevice, 1,
         fmt::format("{}: {} port {} sends to port {} while {} port {} sends to port {}: its bytes are left out; name "
                     "the device's source_address, or its ports",
                     config_.path, to_text(flow.source), flow.source_port, flow.destination_port,
                     to_text(device_flow_->source), device_flow_->source_port, device_flow_->destination_port));
  told_flow_ = flow;
  ++filtered_;
  return false;
}

void PcapSource::take(TcpPiece piece) {
  if (config_.protocol == Protocol::Tcp && !is_of_device(piece)) return;
  flow_ = piece.flow;
  sender_ = piece.flow.source;
  destination_port_ = piece.flow.destination_port;
  piece_heard_ = piece.received;
  if (piece.is_interrupted) {
    tell(FaultKind::Disconnected, std::max<std::uint64_t>(1, piece.missing),
         piece.missing > 0 ? fmt::format("{}: {} bytes that {} sent by TCP are missing in the capture", config_.path,
                                         piece.missing, to_text(sender_))
                           : fmt::format("{}: {} has a new connection", config_.path, to_text(sender_)));
    tell(FaultKind::Reconnected, 1, "the stream goes on");
  }
  if (piece.bytes.empty()) return;
  Packet packet;
  packet.received = piece.received;
  packet.bytes = Buffer::copy_of(piece.bytes);
  ++delivered_;
  waiting_.push_back(std::move(packet));
}

/// Reports a second sender. Scanners send to the same port unless they are set otherwise, and from the same address as
/// they come from the maker; two scanners taken for one would give one wrong cloud.
void PcapSource::watch_sender() {
  if (!first_sender_ || last_ - first_heard_ > kReplacedAfter) {
    first_sender_ = sender_;
    first_card_ = sender_card_;
  }
  if (sender_ == *first_sender_ && sender_card_ == first_card_) {
    first_heard_ = last_;
  } else if (sender_ == *first_sender_) {
    tell(
        FaultKind::WrongDevice, 1,
        fmt::format("{}: two network cards, {} and {}, send as {}, and are taken for one device: two scanners with one "
                    "address? Name the ports of one",
                    config_.path, to_text(first_card_), to_text(sender_card_), to_text(sender_)));
  } else {
    tell(FaultKind::WrongDevice, 1,
         fmt::format("{}: datagrams of {} and of {} are taken for one device's: name its source_address, or its ports",
                     config_.path, to_text(*first_sender_), to_text(sender_)));
  }
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
    if (std::optional<TcpPiece> piece = streams_.next()) {
      take(std::move(*piece));
      continue;
    }
    if (read_) finish(*std::exchange(read_, std::nullopt));
    if (!waiting_.empty()) continue;
    if (ended_) return std::exchange(*ended_, Error{ErrorCode::EndOfData, config_.path + ": end of capture"});
    if (!file_) return Error{ErrorCode::Disconnected, "capture " + config_.path + " is not open"};
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    Result<CaptureFrame> frame = file_->next();
    if (!frame) {
      read_ = frame.error();
      streams_.finish();
      continue;
    }
    const HostTime time(frame->time);
    // pcapng's simple packet blocks have no time; they get the time of the frame before.
    if (count_ns(time) != 0) last_ = time;
    const std::optional<UdpDatagram> datagram = extractor_.extract(*frame);
    if (datagram && config_.protocol != Protocol::Tcp) take(*datagram);
    if (const auto& segment = extractor_.segment(); segment && config_.protocol != Protocol::Udp)
      streams_.take(*segment, last_);
  }
}

/// Reports what could not be delivered, once, before the end.
void PcapSource::finish(Error why) {
  ended_ = std::move(why);
  extractor_.finish();
  const ExtractCounts& c = extractor_.counts();
  const std::uint64_t segments = config_.protocol == Protocol::Udp ? 0 : c.tcp_broken;
  const std::array<std::pair<std::uint64_t, std::string>, 4> losses{
      {{c.cut_off,
        "cut off by the capture (it kept only the beginning of each frame: capture without a limit of length)"},
       {c.malformed + segments, "with broken headers"},
       {c.fragments_dropped, "fragments of datagrams that are not whole"},
       {c.unknown_link, c.unknown_link_type == 227
                            ? "of a CAN bus (the key can_log of `driver: wheel` reads them)"
                            : fmt::format("of a link type that is not read ({})", c.unknown_link_type)}}};
  std::uint64_t lost = 0;
  std::string words;
  for (const auto& [count, what] : losses) {
    lost += count;
    if (count > 0) words += fmt::format("{}{} {}", words.empty() ? "" : ", ", count, what);
  }
  if (lost > 0) tell(FaultKind::Malformed, lost, fmt::format("{}: frames not delivered: {}", config_.path, words));
  if (delivered_ == 0)
    tell(FaultKind::WrongDevice, std::max<std::uint64_t>(1, filtered_ + c.not_udp), config_.path + ": " + others());
}

/// Says in words what a capture without data of the device holds instead.
std::string PcapSource::others() const {
  const ExtractCounts& c = extractor_.counts();
  const char* wanted = config_.protocol == Protocol::Udp   ? "no UDP datagram"
                       : config_.protocol == Protocol::Tcp ? "no TCP stream"
                                                           : "neither UDP datagrams nor TCP streams";
  if (filtered_ > 0) {
    std::string ports, sources;
    for (const auto& [port, count] : other_ports_)
      ports += fmt::format("{}{} ({})", ports.empty() ? "" : ", ", port, count);
    for (const auto& [source, count] : other_sources_)
      sources += fmt::format("{}{} ({})", sources.empty() ? "" : ", ", to_text(source), count);
    if (config_.protocol == Protocol::Tcp)
      return fmt::format("{} of the rig's ports and address; there are streams from the ports {}, of {}", wanted, ports,
                         sources);
    return fmt::format("{} of the rig's ports and address; there are datagrams to the ports {}, from {}", wanted, ports,
                       sources);
  }
  if (config_.protocol == Protocol::Udp && c.tcp > 0)
    return fmt::format("{}; {} frames are of TCP connections", wanted, c.tcp);
  if (config_.protocol == Protocol::Tcp && c.datagrams > 0)
    return fmt::format("{}; there are {} UDP datagrams", wanted, c.datagrams);
  if (c.not_udp > 0) return fmt::format("{}; {} frames are of other protocols", wanted, c.not_udp);
  return wanted;
}

}  // namespace hueline::drivers
