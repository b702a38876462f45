#include "sim/devices/gvcp_control.hpp"

#include <utility>

#include "sim/devices/big_endian.hpp"

namespace hueline::sim {
namespace {

constexpr std::size_t kHeaderBytes = 8;
constexpr std::byte kCommandKey{0x42};
constexpr std::uint32_t kDiscovery = 0x0002, kPacketResend = 0x0040, kReadRegister = 0x0080, kWriteRegister = 0x0082,
                        kReadMemory = 0x0084, kWriteMemory = 0x0086;
constexpr std::uint16_t kSuccess = 0, kNotImplemented = 0x8001, kInvalidParameter = 0x8002, kInvalidAddress = 0x8003,
                        kAccessDenied = 0x8006;
constexpr std::uint32_t kDiscoveryBytes = 0xF8;
constexpr std::uint32_t kMostMemoryBytes = 536;
constexpr std::uint32_t kFireTestBit = 1U << 31U;
constexpr std::uint32_t kPrivilegeBits = 3;  // exclusive access or control access

Bytes answer(std::uint32_t command, std::uint16_t status, std::uint32_t id, const Bytes& body = {}) {
  Bytes out;
  out.reserve(kHeaderBytes + body.size());
  put_be16(out, status);
  put_be16(out, command + 1);  // the number of an acknowledge is that of its command plus one
  put_be16(out, static_cast<std::uint32_t>(body.size()));
  put_be16(out, id);
  out.insert(out.end(), body.begin(), body.end());
  return out;
}

}  // namespace

bool GvcpControl::is_controller(const sockaddr_in& address) const {
  return is_controlled_ && address.sin_port == controller_.sin_port &&
         address.sin_addr.s_addr == controller_.sin_addr.s_addr;
}

void GvcpControl::release() {
  is_controlled_ = false;
  registers_->set(camera_register::kPrivilege, 0);
  registers_->set(camera_register::kAcquisition, 0);
}

bool GvcpControl::check_heartbeat(std::int64_t now_ns) {
  const std::int64_t timeout_ns = registers_->get(camera_register::kHeartbeatTimeoutMs) * 1'000'000LL;
  if (!is_controlled_ || now_ns - heard_ns_ <= timeout_ns) return false;
  release();
  return true;
}

std::uint16_t GvcpControl::write_register(std::uint32_t address, std::span<const std::byte> bytes,
                                          const sockaddr_in& from, GvcpOutcome& outcome) {
  if (is_controlled_ && !is_controller(from)) return kAccessDenied;
  if (address != camera_register::kPrivilege && !is_controlled_) return kAccessDenied;
  if (!registers_->write(address, bytes)) return kInvalidAddress;

  if (address == camera_register::kPrivilege) {
    if ((registers_->get(address) & kPrivilegeBits) == 0) {
      release();
    } else {
      is_controlled_ = true;
      controller_ = from;
    }
  }
  if (const std::uint32_t size = registers_->get(camera_register::kStreamPacketSize);
      address == camera_register::kStreamPacketSize && (size & kFireTestBit) != 0) {
    registers_->set(address, size & ~kFireTestBit);  // the bit is a command and clears itself
    outcome.is_test_packet_due = true;
  }
  return kSuccess;
}

GvcpOutcome GvcpControl::handle(std::span<const std::byte> datagram, const sockaddr_in& from, std::int64_t now_ns) {
  GvcpOutcome outcome;
  if (datagram.size() < kHeaderBytes || datagram[0] != kCommandKey) return outcome;
  const std::uint32_t command = get_be16(datagram, 2), size = get_be16(datagram, 4), id = get_be16(datagram, 6);
  if (datagram.size() < kHeaderBytes + size) return outcome;
  const std::span<const std::byte> body = datagram.subspan(kHeaderBytes, size);
  if (is_controller(from)) heard_ns_ = now_ns;

  std::uint16_t status = kSuccess;
  Bytes out;
  switch (command) {
    case kDiscovery:
      out.resize(kDiscoveryBytes);
      (void)registers_->read(0, out);
      break;
    case kReadRegister:
      if (body.empty() || body.size() % 4 != 0) status = kInvalidParameter;
      for (std::size_t at = 0; status == kSuccess && at < body.size(); at += 4) {
        put_be32(out, registers_->get(get_be32(body, at)));
      }
      break;
    case kWriteRegister: {
      std::uint32_t written = 0;
      if (body.empty() || body.size() % 8 != 0) status = kInvalidParameter;
      for (std::size_t at = 0; status == kSuccess && at < body.size(); at += 8) {
        status = write_register(get_be32(body, at), body.subspan(at + 4, 4), from, outcome);
        if (status == kSuccess) ++written;
      }
      put_be16(out, 0);
      put_be16(out, written);
      break;
    }
    case kReadMemory: {
      const std::uint32_t count = body.size() == 8 ? get_be16(body, 6) : 0;
      if (count == 0 || count > kMostMemoryBytes) {
        status = kInvalidParameter;
        break;
      }
      put_be32(out, get_be32(body, 0));
      out.resize(4 + count);
      if (!registers_->read(get_be32(body, 0), std::span(out).subspan(4))) {
        status = kInvalidAddress;
        out.clear();
      }
      break;
    }
    case kWriteMemory:
      status = body.size() > 4 ? write_register(get_be32(body, 0), body.subspan(4), from, outcome) : kInvalidParameter;
      put_be16(out, 0);
      put_be16(out, status == kSuccess ? static_cast<std::uint32_t>(body.size() - 4) : 0);
      break;
    case kPacketResend:
      // Requests come from the controller's machine, but from another port: its stream socket sends them.
      if (body.size() == 12 && is_controlled_ && from.sin_addr.s_addr == controller_.sin_addr.s_addr) {
        outcome.has_resend = true;
        outcome.resend = {static_cast<std::uint16_t>(get_be16(body, 2)), get_be32(body, 4) & 0xffffffU,
                          get_be32(body, 8) & 0xffffffU};
      }
      return outcome;  // requests are never acknowledged; the packets are the answer
    default:
      status = kNotImplemented;
      break;
  }
  if (is_controller(from)) heard_ns_ = now_ns;  // also after the command that made it the controller
  outcome.answer = answer(command, status, id, out);
  return outcome;
}

}  // namespace hueline::sim
