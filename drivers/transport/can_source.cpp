#include "drivers/transport/can_source.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "drivers/can/can_frame.hpp"
#include "drivers/transport/socket_option.hpp"

namespace hueline::drivers {
namespace {

constexpr int kFrameWait_ms = 100;
static_assert(sizeof(can_frame) == kCanFrameSize && sizeof(canfd_frame) == kCanFdFrameSize);

bool is_absence(int why) { return why == ENETDOWN || why == ENODEV || why == ENXIO; }

}  // namespace

/// Where recvmmsg() stores one frame.
struct CanSource::Slot {
  canfd_frame frame{};
  alignas(cmsghdr) std::array<char, 256> control{};
  iovec vector{};
  bool is_local = false;
  std::optional<nanoseconds> stamp;  ///< CLOCK_REALTIME
  nanoseconds adapter_stamp{0};
  std::optional<std::uint32_t> kernel_drops;
};

void CanSource::Config::visit(Keys& keys) {
  static const TextForm name{"1 to 15 characters", [](const std::string& text) { return text.size() < IFNAMSIZ; },
                             "^.{1,15}$"};
  keys.text(required("interface", "", "The CAN interface, such as can0 or vcan0."), interface, name);
  keys.whole({"receive_buffer_bytes", "bytes", "The size of the kernel's receive buffer."}, receive_buffer_bytes,
             {4096, 1 << 30});
}

KeyError CanSource::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (interface.empty()) return not_allowed("interface", "empty", "1 to 15 characters");
  if (batch < 1 || batch > 1024) return not_allowed("batch", std::to_string(batch), "1 to 1024");
  return {};
}

CanSource::CanSource(Config config, BufferPool pool) : config_(std::move(config)), pool_(std::move(pool)) {}

CanSource::~CanSource() { close(); }

void CanSource::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  pending_.clear();
}

Status CanSource::open() {
  close();
  if (const std::string wrong = config_.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  const auto refuse = [&](Error error) -> Status {
    close();
    return error;
  };
  fd_ = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
  if (fd_ < 0) {
    const int why = errno;
    Error error = io_error("open a CAN socket", why);
    if (why == EAFNOSUPPORT || why == EPROTONOSUPPORT)
      error = {ErrorCode::Unavailable, "this kernel has no CAN: modprobe can_raw"};
    return refuse(std::move(error));
  }
  ifreq request{};
  config_.interface.copy(request.ifr_name, IFNAMSIZ - 1);
  if (::ioctl(fd_, SIOCGIFINDEX, &request) != 0)
    return refuse({ErrorCode::Unavailable,
                   fmt::format("there is no network interface {}: is the adapter plugged in?", config_.interface)});
  const int index = request.ifr_ifindex;
  if (::ioctl(fd_, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) == 0)
    return refuse(
        {ErrorCode::Unavailable,
         fmt::format("{0} is down: ip link set {0} up type can bitrate 500000 restart-ms 100", config_.interface)});

  const int on = 1;
  const can_err_mask_t errors = CAN_ERR_MASK;
  if (!set_socket_option(fd_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, on))
    return refuse(io_error("ask for CAN FD frames", errno));
  if (!set_socket_option(fd_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, errors))
    return refuse(io_error("ask for error frames", errno));
  if (!set_socket_option(fd_, SOL_SOCKET, SO_RCVBUFFORCE, config_.receive_buffer_bytes) &&
      !set_socket_option(fd_, SOL_SOCKET, SO_RCVBUF, config_.receive_buffer_bytes))
    return refuse(io_error("set the receive buffer of " + config_.interface, errno));
  const int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_RX_HARDWARE |
                     SOF_TIMESTAMPING_RAW_HARDWARE;
  if (!set_socket_option(fd_, SOL_SOCKET, SO_TIMESTAMPING, stamps))
    return refuse(io_error("ask for stamps on " + config_.interface, errno));
  if (!set_socket_option(fd_, SOL_SOCKET, SO_RXQ_OVFL, on))
    return refuse(io_error("ask for the drop counter of " + config_.interface, errno));
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    const int why = errno;
    Error error = io_error("listen on " + config_.interface, why);
    // An interface of another kind, such as Ethernet, cannot become a CAN interface later, so asking again is useless.
    if (why == ENODEV) error = {ErrorCode::Invalid, config_.interface + " is no CAN interface"};
    if (why == ENETDOWN) error.code = ErrorCode::Unavailable;
    return refuse(std::move(error));
  }
  kernel_drops_ = 0;
  slots_.resize(static_cast<std::size_t>(config_.batch));
  return {};
}

Error CanSource::gone(const std::string& attempted, int why) const {
  if (why == ENETDOWN) return {ErrorCode::Disconnected, config_.interface + " was set down"};
  Error error = io_error(attempted, why);
  if (is_absence(why)) error = {ErrorCode::Disconnected, config_.interface + " is gone: was the adapter unplugged?"};
  return error;
}

Result<Packet> CanSource::next(std::stop_token stop) {
  if (fd_ < 0) return Error{ErrorCode::Disconnected, config_.interface + " is not open"};
  if (pending_.empty()) {
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    pollfd waiting{fd_, POLLIN, 0};
    const int ready = ::poll(&waiting, 1, kFrameWait_ms);
    if (ready < 0 && errno != EINTR) return io_error("wait for CAN frames", errno);
    if (ready <= 0) return Error{ErrorCode::TimedOut, "no CAN frame"};
    if (Status status = read(); !status) return status.error();
    if (pending_.empty()) return Error{ErrorCode::TimedOut, "no CAN frame"};
  }
  Packet packet = std::move(pending_.front());
  pending_.pop_front();
  return packet;
}

Status CanSource::read() {
  std::vector<mmsghdr> headers(slots_.size());
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    Slot& slot = slots_[i];
    slot.frame = {};
    slot.vector = {&slot.frame, sizeof(slot.frame)};
    msghdr& header = headers[i].msg_hdr;
    header.msg_iov = &slot.vector;
    header.msg_iovlen = 1;
    header.msg_control = slot.control.data();
    header.msg_controllen = slot.control.size();
  }
  const int taken = ::recvmmsg(fd_, headers.data(), static_cast<unsigned>(headers.size()), MSG_DONTWAIT, nullptr);
  if (taken < 0) {
    const int why = errno;
    if (why == EAGAIN || why == EWOULDBLOCK || why == EINTR) return {};
    return gone("receive CAN frames", why);
  }
  const ClockOffset offset = sample_clock_offset(KernelClock::Realtime);
  for (int i = 0; i < taken; ++i) {
    Slot& slot = slots_[static_cast<std::size_t>(i)];
    mmsghdr& header = headers[static_cast<std::size_t>(i)];
    slot.is_local = (header.msg_hdr.msg_flags & MSG_DONTROUTE) != 0;
    slot.stamp.reset();
    slot.adapter_stamp = nanoseconds(0);
    slot.kernel_drops.reset();
    for (cmsghdr* c = CMSG_FIRSTHDR(&header.msg_hdr); c; c = CMSG_NXTHDR(&header.msg_hdr, c)) {
      if (c->cmsg_level != SOL_SOCKET) continue;
      if (c->cmsg_type == SCM_TIMESTAMPING) {
        std::array<std::timespec, 3> stamps{};  // the software stamp, an unused one, the adapter's own stamp
        std::memcpy(stamps.data(), CMSG_DATA(c), sizeof(stamps));
        if (const nanoseconds software = to_nanoseconds(stamps[0]); software.count() != 0) slot.stamp = software;
        slot.adapter_stamp = to_nanoseconds(stamps[2]);
      } else if (c->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t drops = 0;
        std::memcpy(&drops, CMSG_DATA(c), sizeof(drops));
        slot.kernel_drops = drops;
      }
    }
    deliver(slot, header.msg_len, offset);
  }
  return {};
}

void CanSource::deliver(Slot& slot, std::size_t size, const ClockOffset& offset) {
  const HostTime received = slot.stamp ? to_host_time(*slot.stamp, offset) : host_now();
  if (slot.kernel_drops && *slot.kernel_drops != kernel_drops_) {
    const std::uint32_t lost = *slot.kernel_drops - kernel_drops_;  // correct when the kernel's 32-bit counter wraps
    kernel_drops_ = *slot.kernel_drops;
    push_overflow(received, lost,
                  "the socket's buffer was full before this frame: raise receive_buffer_bytes or net.core.rmem_max");
  }
  CanFrame head;  // the header only; the frame itself stays as the kernel delivered it
  head.is_fd = size == kCanFdFrameSize;
  head.is_local = slot.is_local;
  if (slot.adapter_stamp.count() != 0) head.adapter_time = DeviceTime<CanAdapterCounter>(slot.adapter_stamp);
  const std::vector<std::byte> bytes = encode_can_packet(head);
  const std::size_t frame = head.is_fd ? kCanFdFrameSize : kCanFrameSize;
  MutableBuffer buffer = pool_.acquire(bytes.size());
  if (!buffer)
    return push_overflow(received, 1,
                         fmt::format("a frame came while the pool of {} bytes was full", pool_.limit_bytes()));
  std::copy(bytes.begin(), bytes.end(), buffer.data());
  std::memcpy(buffer.data() + kCanHeaderSize, &slot.frame, frame);
  Packet packet;
  packet.kind = PacketKind::Wire;
  packet.received = received;
  packet.bytes = std::move(buffer).share();
  pending_.push_back(std::move(packet));
}

void CanSource::push_overflow(HostTime time, std::uint64_t count, std::string detail) {
  pending_.push_back(fault_packet(time, FaultKind::Overflow, count, std::move(detail)));
}

}  // namespace hueline::drivers
