#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

/// Sends a camera's client datagrams that no camera sends, as any computer on its network could.
namespace hueline::test {

class HostileSender {
 public:
  /// Sends from `source`, an address of this computer, to the client's stream port.
  HostileSender(const std::string& source, const std::string& client, std::uint16_t port)
      : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in from{}, to{};
    from.sin_family = to.sin_family = AF_INET;
    ::inet_pton(AF_INET, source.c_str(), &from.sin_addr);
    ::inet_pton(AF_INET, client.c_str(), &to.sin_addr);
    to.sin_port = htons(port);
    is_ready_ = ::bind(socket_, reinterpret_cast<const sockaddr*>(&from), sizeof(from)) == 0 &&
                ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0;
  }
  HostileSender(const HostileSender&) = delete;
  ~HostileSender() { ::close(socket_); }
  bool is_ready() const { return is_ready_; }
  std::uint64_t sent() const { return sent_; }

  /// The two datagrams that kill Aravis 0.8.26: a trailer after a million packets, then data of one of them.
  void kill(std::uint16_t frame_id) {
    send(packet(frame_id, 2, 1'000'000, 8));
    send(packet(frame_id, 3, 999'000, 1400));
  }
  /// Datagrams that make it allocate gigabytes: trailers of twenty images, with plain and with extended ids, each after
  /// the largest number of packets.
  void fill_memory(std::uint16_t frame_id) {
    for (std::uint16_t i = 0; i < 20; ++i) send(packet(static_cast<std::uint16_t>(frame_id + i), 2, 0xfffffe, 8));
    for (std::uint32_t i = 0; i < 20; ++i) send(extended_packet(frame_id + i, 2, 0x03fffffe, 8));
  }
  /// A leader of many parts, each of which claims the largest size that 48 bits can hold.
  void claim_parts(std::uint16_t frame_id) {
    auto leader = packet(frame_id, 1, 255, 12 + 255 * 48);
    for (std::size_t i = 20; i < leader.size(); ++i) leader[i] = 0xff;
    leader[10] = 0x00, leader[11] = 0x0a;
    send(leader);
  }
  /// Random datagrams: content type, number and length, some with extended ids, some without room for a header.
  void anything(std::mt19937& random, std::size_t count) {
    const auto below = [&](std::uint32_t limit) {
      return std::uniform_int_distribution<std::uint32_t>(0, limit - 1)(random);
    };
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t number = below(3) == 0 ? below(0x1000000) : below(80);
      const std::size_t size = below(4) == 0 ? 0 : below(2000);
      auto bytes = below(3) == 0 ? extended_packet(below(70'000), below(10),
                                                   below(2) ? number : static_cast<std::uint32_t>(random()), size)
                                 : packet(static_cast<std::uint16_t>(below(65'536)), below(10), number, size);
      for (std::size_t at = 8; at < bytes.size(); ++at) bytes[at] = static_cast<std::uint8_t>(random());
      if (below(8) == 0) bytes.resize(below(8));
      if (below(8) == 0 && !bytes.empty()) bytes[0] = 0x80;
      send(bytes);
    }
  }

  using Bytes = std::vector<std::uint8_t>;
  static Bytes packet(std::uint16_t frame_id, std::uint32_t type, std::uint32_t number, std::size_t payload) {
    Bytes out{0, 0};
    put(out, frame_id, 2);
    put(out, type << 24 | (number & 0xffffff), 4);
    out.resize(out.size() + payload);
    return out;
  }
  static Bytes extended_packet(std::uint64_t frame_id, std::uint32_t type, std::uint32_t number, std::size_t payload) {
    Bytes out{0, 0, 0, 0};
    put(out, 0x80000000U | type << 24, 4);
    put(out, frame_id, 8);
    put(out, number, 4);
    out.resize(out.size() + payload);
    return out;
  }
  void send(const Bytes& bytes) {
    sent_ += ::send(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT) == static_cast<ssize_t>(bytes.size());
  }

 private:
  static void put(Bytes& out, std::uint64_t value, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  const int socket_;
  bool is_ready_ = false;
  std::uint64_t sent_ = 0;
};

}  // namespace hueline::test
