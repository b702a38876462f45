#include "storage/pcap_writer.hpp"

#include <string>

namespace hueline::storage {
namespace {

constexpr std::uint32_t kMagicNanoseconds = 0xA1B23C4D, kLinkRawIp = 101, kSnapLength = 262144;
constexpr std::size_t kIpBytes = 20, kUdpBytes = 8;
constexpr std::uint32_t kLocalhost = 0x7F000001;
constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Appends a number in the order of the network.
void append_net(Bytes& out, std::uint32_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) append(out, static_cast<std::uint8_t>(value >> (8 * i)));
}

/// The checksum of an IPv4 header: the complement of the sum of its 16-bit words.
std::uint16_t checksum(ByteView header) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i + 1 < header.size(); i += 2)
    sum += std::to_integer<std::uint32_t>(header[i]) << 8U | std::to_integer<std::uint32_t>(header[i + 1]);
  while (sum >> 16U) sum = (sum & 0xFFFF) + (sum >> 16U);
  return static_cast<std::uint16_t>(~sum);
}

}  // namespace

Result<PcapWriter> PcapWriter::create(const std::filesystem::path& path, Disk& disk) {
  auto file = FileWriter::replace(path, disk);
  if (!file.ok()) return file.error();
  PcapWriter out(std::move(*file));
  Bytes head;
  append(head, kMagicNanoseconds);
  append(head, std::uint16_t{2});
  append(head, std::uint16_t{4});
  append(head, std::uint64_t{0});  // zone and accuracy, which nobody uses
  append(head, kSnapLength);
  append(head, kLinkRawIp);
  if (Status done = out.file_.write(head); !done.ok()) return done.error();
  return out;
}

Status PcapWriter::write(UnixTime time, std::uint16_t port, ByteView payload) {
  const std::int64_t ns = count_ns(time);
  if (payload.size() > kMostPayload)
    return Error{ErrorCode::Invalid, "a packet of " + std::to_string(payload.size()) +
                                         " bytes is larger than a datagram: it is not of a network device"};
  if (ns < 0 || ns / kSecond_ns > 0xFFFFFFFF)
    return Error{ErrorCode::Invalid, "a packet's time is not within 1970 to 2106, which a capture file can hold"};
  const auto total = static_cast<std::uint32_t>(kIpBytes + kUdpBytes + payload.size());
  head_.clear();
  append(head_, static_cast<std::uint32_t>(ns / kSecond_ns));
  append(head_, static_cast<std::uint32_t>(ns % kSecond_ns));
  append(head_, total);
  append(head_, total);
  const std::size_t ip = head_.size();
  append_net(head_, 0x4500, 2);  // version 4, header of five words
  append_net(head_, total, 2);
  append_net(head_, 0, 4);       // no fragments
  append_net(head_, 0x4011, 2);  // 64 hops, UDP
  append_net(head_, 0, 2);
  append_net(head_, kLocalhost, 4);
  append_net(head_, kLocalhost, 4);
  const std::uint16_t sum = checksum(ByteView(head_).subspan(ip, kIpBytes));
  head_[ip + 10] = static_cast<std::byte>(sum >> 8U);
  head_[ip + 11] = static_cast<std::byte>(sum);
  append_net(head_, port, 2);
  append_net(head_, port, 2);
  append_net(head_, static_cast<std::uint32_t>(kUdpBytes + payload.size()), 2);
  append_net(head_, 0, 2);  // no checksum, which IPv4 allows
  const ByteView pieces[]{head_, payload};
  return file_.write(pieces);
}

}  // namespace hueline::storage
