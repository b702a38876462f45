#include "drivers/gige/gvsp_filter.hpp"

#include <fmt/format.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <utility>

namespace hueline::drivers {
namespace {

constexpr std::uint32_t kIpAndUdp = 28;
constexpr std::uint32_t kUdpHeader = 8;
constexpr std::uint32_t kWhole = 0x40000;  // return value of a filter that passes: more bytes than any datagram has
constexpr std::uint32_t kLeader = 1, kTrailer = 2, kData = 3;
constexpr std::uint32_t kLeaderBytes = 36;  // shortest leader of an image after the GVSP header, with its region
constexpr std::uint32_t kImage = 1, kImageWithChunks = 5;

/// Builds a filter program without loops: each check drops the packet or goes on to the next instruction.
class Program {
 public:
  Program& load(unsigned size, std::uint32_t at) { return add(BPF_LD | size | BPF_ABS, at); }
  Program& mask(std::uint32_t bits) { return add(BPF_ALU | BPF_AND | BPF_K, bits); }
  Program& plus(std::uint32_t value) { return add(BPF_ALU | BPF_ADD | BPF_K, value); }
  Program& keep() { return add(BPF_MISC | BPF_TAX, 0); }
  Program& length() { return add(BPF_LD | BPF_W | BPF_LEN, 0); }
  Program& must_equal(std::uint32_t value) { return must(BPF_JEQ | BPF_K, value); }
  Program& must_equal_kept() { return must(BPF_JEQ | BPF_X, 0); }
  Program& must_reach(std::uint32_t value) { return must(BPF_JGE | BPF_K, value); }
  Program& must_reach_kept() { return must(BPF_JGE | BPF_X, 0); }
  Program& must_not_exceed(std::uint32_t value) {
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JGT | BPF_K, value, 0, 1));
    return drop();
  }
  Program& must_lack(std::uint32_t bits) {
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, bits, 0, 1));
    return drop();
  }
  Program& drop() { return add(BPF_RET | BPF_K, 0); }
  Program& pass() { return add(BPF_RET | BPF_K, kWhole); }
  /// Runs `then` if the condition holds, else goes on. `then` must end with drop() or pass().
  Program& on(unsigned condition, std::uint32_t value, const Program& then) {
    code_.push_back(BPF_JUMP(BPF_JMP | condition | BPF_K, value, 1, 0));
    add(BPF_JMP | BPF_JA, static_cast<std::uint32_t>(then.code_.size()));
    code_.insert(code_.end(), then.code_.begin(), then.code_.end());
    return *this;
  }
  std::vector<sock_filter> take() { return std::move(code_); }

 private:
  Program& add(unsigned code, std::uint32_t value) {
    code_.push_back(BPF_STMT(static_cast<std::uint16_t>(code), value));
    return *this;
  }
  Program& must(unsigned condition, std::uint32_t value) {
    code_.push_back(BPF_JUMP(static_cast<std::uint16_t>(BPF_JMP | condition), value, 1, 0));
    return drop();
  }
  std::vector<sock_filter> code_;
};

/// Makes the checks of a GVSP packet that begins at byte `at` of what the filter sees, directly after its UDP header.
Program gvsp_checks(const GvspStreamShape& shape, std::uint32_t at, bool has_extended_ids) {
  const std::uint32_t header = has_extended_ids ? 20 : 8, udp_length_at = at - 4;
  const std::uint32_t block = shape.packet_bytes - kIpAndUdp - header;
  const auto data_packets = static_cast<std::uint32_t>((shape.payload_bytes + block - 1) / block);
  const auto with_number = [&](Program program = {}) {
    return has_extended_ids ? program.load(BPF_W, at + 16) : program.load(BPF_W, at + 4).mask(0xffffff);
  };
  Program leader =
      with_number().must_equal(0).load(BPF_H, udp_length_at).must_reach(kUdpHeader + header + kLeaderBytes);
  // Only leaders of an image, with or without chunks after it. For other payload types Aravis would allocate memory by
  // numbers in the leader, although it makes no image of them.
  leader.load(BPF_H, at + header + 2)
      .mask(0x3fff)
      .on(BPF_JEQ, kImage, Program().pass())
      .must_equal(kImageWithChunks)
      .pass();
  const Program data = with_number().must_reach(1).must_not_exceed(data_packets).pass();
  const Program trailer = with_number().must_reach(2).must_not_exceed(data_packets + 1).pass();
  return Program()
      .load(BPF_H, udp_length_at)
      .must_reach(kUdpHeader + header)
      .must_not_exceed(shape.packet_bytes - kIpAndUdp + kUdpHeader)
      .load(BPF_B, at + 4)
      .mask(0x7f)
      .on(BPF_JEQ, kData, data)
      .on(BPF_JEQ, kLeader, leader)
      .on(BPF_JEQ, kTrailer, trailer)
      .drop();
}

std::vector<sock_filter> with_gvsp_checks(Program before, const GvspStreamShape& shape, std::uint32_t at) {
  before.load(BPF_H, at - 4)
      .must_reach(kUdpHeader + 8)
      .load(BPF_B, at + 4)
      .on(BPF_JSET, 0x80, gvsp_checks(shape, at, true));
  std::vector<sock_filter> code = before.take(), rest = gvsp_checks(shape, at, false).take();
  code.insert(code.end(), rest.begin(), rest.end());
  return code;
}

}  // namespace

std::vector<sock_filter> gvsp_filter_of_udp_socket(const GvspStreamShape& shape) {
  Program source;
  source.load(BPF_W, static_cast<std::uint32_t>(SKF_NET_OFF) + 12).must_equal(ntohl(shape.camera.s_addr));
  return with_gvsp_checks(std::move(source), shape,
                          kUdpHeader);  // the filter of a UDP socket sees the UDP header first
}

std::vector<sock_filter> gvsp_filter_of_packet_socket(const GvspStreamShape& shape) {
  constexpr std::uint32_t kIp = 14, kUdp = kIp + 20;
  Program lower;
  lower.load(BPF_H, 12).must_equal(0x0800);
  lower.load(BPF_B, kIp).must_equal(0x45);  // IPv4 without options, as Aravis assumes
  lower.load(BPF_B, kIp + 9).must_equal(IPPROTO_UDP);
  lower.load(BPF_H, kIp + 6).must_lack(0x3fff);  // not a fragment
  lower.load(BPF_W, kIp + 12).must_equal(ntohl(shape.camera.s_addr));
  lower.load(BPF_W, kIp + 16).must_equal(ntohl(shape.own.s_addr));
  lower.load(BPF_H, kUdp + 2).must_equal(shape.own_port);
  // The lengths must agree: Aravis uses the length in the IP header, but the packet ends where the frame ends.
  lower.load(BPF_H, kIp + 2).plus(kIp).keep().length().must_reach_kept();
  lower.load(BPF_H, kUdp + 4).plus(20).keep().load(BPF_H, kIp + 2).must_equal_kept();
  return with_gvsp_checks(std::move(lower), shape, kUdp + kUdpHeader);
}

std::vector<sock_filter> gvcp_filter(in_addr camera) {
  constexpr std::uint32_t kGvcpPort = 3956;
  Program program;
  program.load(BPF_W, static_cast<std::uint32_t>(SKF_NET_OFF) + 12).must_equal(ntohl(camera.s_addr));
  program.load(BPF_H, 0).must_equal(kGvcpPort).pass();
  return program.take();
}

std::vector<sock_filter> filter_of_nothing() { return Program().drop().take(); }

Status attach_filter(int socket, const std::vector<sock_filter>& filter) {
  std::vector<sock_filter> code(filter);
  const sock_fprog program{static_cast<unsigned short>(code.size()), code.data()};
  if (::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof(program)) != 0)
    return io_error("attach the filter of a camera's stream", errno);
  return {};
}

std::vector<int> own_sockets(int domain, int type) {
  std::vector<int> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const int fd = std::atoi(entry.path().filename().c_str());
    int is_domain = 0, is_type = 0;
    socklen_t size = sizeof(int);
    if (::getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &is_domain, &size) == 0 && is_domain == domain &&
        ::getsockopt(fd, SOL_SOCKET, SO_TYPE, &is_type, &size) == 0 && is_type == type)
      found.push_back(fd);
  }
  return found;
}

sockaddr_in bound_address(int socket) {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0 || address.sin_family != AF_INET)
    return {};
  return address;
}

}  // namespace hueline::drivers
