#include "drivers/guest/guest_side.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <pthread.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/guest/guest_limits.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers::guest {
namespace {

constexpr int kAlivePeriodMs = 200;
// A silent camera takes Aravis 3 s, and the camera's description may come slowly.
constexpr std::chrono::milliseconds kConnectsWithin{12'000};
constexpr std::chrono::milliseconds kReadsWithin{1500};  // next() itself waits 100 ms
constexpr std::chrono::milliseconds kMemoryWithin{2000};
constexpr std::size_t kMemoryToConnect = std::size_t{1} << 30, kMemoryToStream = std::size_t{256} << 20;
constexpr int kBrokenConversation = 3, kStoppedEarly = 4;

/// Receives one message with its descriptor. EndOfData: the host is gone.
Result<ToGuest> receive(int socket, FileDescriptor& descriptor, std::span<std::byte> space) {
  iovec part{space.data(), space.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  ssize_t size = 0;
  do size = ::recvmsg(socket, &header, MSG_CMSG_CLOEXEC);
  while (size < 0 && errno == EINTR);
  if (size <= 0) return Error{ErrorCode::EndOfData, "the host has hung up"};
  for (cmsghdr* rights = CMSG_FIRSTHDR(&header); rights; rights = CMSG_NXTHDR(&header, rights)) {
    if (rights->cmsg_level != SOL_SOCKET || rights->cmsg_type != SCM_RIGHTS) continue;
    int fd = -1;
    std::memcpy(&fd, CMSG_DATA(rights), sizeof(fd));
    descriptor = FileDescriptor(fd);
  }
  return decode_for_guest(space.first(static_cast<std::size_t>(size)));
}

[[noreturn]] void end_as(const char* why, int status) {
  std::fprintf(stderr, "%s\n", why);
  ::_exit(status);
}

}  // namespace

Status GuestMemory::prepare(std::size_t packet_bytes) {
  if (const Status asked = ask_(packet_bytes); !asked) return asked;
  Lock lock(mutex_);
  if (!changed_.wait_for(lock, kMemoryWithin, [this]() HUELINE_REQUIRES(mutex_) { return has_begun_; }))
    return Error{ErrorCode::Unavailable, "the host gives no memory"};
  if (slot_bytes_ < packet_bytes) return Error{ErrorCode::Invalid, "the host's slots are too small"};
  return {};
}

Status GuestMemory::map(const Memory& memory, int fd) {
  const std::uint64_t bytes = memory.slot_bytes * memory.slots;
  if (const Status limited = limit_memory(bytes + kMemoryToStream); !limited) return limited;
  auto mapping = Mapping::map(fd, bytes, true);
  if (!mapping) return mapping.error();
  Lock lock(mutex_);
  mapping_ = std::move(mapping).value();
  slot_bytes_ = memory.slot_bytes;
  slots_ = memory.slots;
  free_.reserve(slots_);
  with_host_.resize(slots_);
  return {};
}

bool GuestMemory::add(const std::vector<std::uint32_t>& slots) {
  std::vector<Buffer> back;  // destroyed outside the lock, which give_back() takes
  {
    Lock lock(mutex_);
    for (const std::uint32_t slot : slots) {
      if (slot >= slots_) return false;
      if (has_begun_ && !with_host_[slot].empty())
        back.push_back(std::exchange(with_host_[slot], {}));
      else
        free_.push_back(slot);
    }
    has_begun_ = true;
  }
  changed_.notify_all();
  return true;
}

std::uint32_t GuestMemory::slot_of(const std::byte* data) const {
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(data - mapping_.bytes().data()) / slot_bytes_);
}

std::uint32_t GuestMemory::hand_out(Buffer packet) {
  Lock lock(mutex_);
  const std::uint32_t slot = slot_of(packet.data());
  with_host_[slot] = std::move(packet);
  return slot;
}

void GuestMemory::give_back(const std::byte* data) noexcept {
  Lock lock(mutex_);
  free_.push_back(slot_of(data));
}

MutableBuffer GuestMemory::acquire(std::size_t bytes) {
  std::span<std::byte> memory;
  {
    Lock lock(mutex_);
    if (free_.empty() || bytes > slot_bytes_) return {};
    memory = mapping_.bytes().subspan(free_.back() * slot_bytes_, bytes);
    free_.pop_back();
  }
  return MutableBuffer::lent(shared_from_this(), memory);
}

std::size_t GuestMemory::bytes_in_use() const {
  Lock lock(mutex_);
  return (slots_ - free_.size()) * slot_bytes_;
}

std::size_t GuestMemory::limit_bytes() const {
  Lock lock(mutex_);
  return slots_ * slot_bytes_;
}

HostLink::HostLink(int socket) : socket_(socket), allowed_until_ns_(0) {
  FileDescriptor none;
  std::vector<std::byte> space(kMostMessageBytes);
  auto first = receive(socket_, none, space);
  if (!first || !std::holds_alternative<Config>(*first)) end_as("no settings came", kBrokenConversation);
  config_ = std::get<Config>(std::move(first).value());
  memory_ = std::make_shared<GuestMemory>([this](std::uint64_t bytes) -> Status {
    send(NeedMemory{bytes});
    return {};
  });
  allow(kConnectsWithin);
  listener_ = std::jthread([this] { listen(); });
}

void HostLink::allow(std::chrono::milliseconds time) {
  allowed_until_ns_.store((host_now() + time).time_since_epoch().count(), std::memory_order_relaxed);
}

void HostLink::listen() {
  ::pthread_setname_np(::pthread_self(), "guest-link");
  std::vector<std::byte> space(kMostMessageBytes);
  const std::vector<std::byte> alive = encode(ToHost(Alive{}));
  HostTime due = host_now();
  for (;;) {
    if (const HostTime now = host_now(); now >= due) {
      due = now + std::chrono::milliseconds(kAlivePeriodMs);
      // A host that is stopped does not read. The messages in the socket are enough for it when it goes on.
      if (now.time_since_epoch().count() < allowed_until_ns_.load(std::memory_order_relaxed) &&
          ::send(socket_, alive.data(), alive.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0 && errno == EPIPE)
        ::_exit(0);
    }
    pollfd readable{socket_, POLLIN, 0};
    if (::poll(&readable, 1, kAlivePeriodMs) <= 0) continue;
    FileDescriptor descriptor;
    auto message = receive(socket_, descriptor, space);
    if (message) {
      take(std::move(message).value(), std::move(descriptor));
    } else if (message.error().code == ErrorCode::EndOfData) {
      ::_exit(0);
    } else {
      end_as(message.error().message.c_str(), kBrokenConversation);
    }
  }
}

void HostLink::take(ToGuest message, FileDescriptor descriptor) {
  if (auto* memory = std::get_if<Memory>(&message)) {
    if (const Status mapped = memory_->map(*memory, descriptor.get()); !mapped)
      end_as(mapped.error().message.c_str(), kBrokenConversation);
  } else if (auto* back = std::get_if<GiveBack>(&message)) {
    if (!memory_->add(back->slots)) end_as("a slot that does not exist", kBrokenConversation);
  } else if (std::holds_alternative<Stop>(message)) {
    stop_.request_stop();
  }
}

void HostLink::send(const ToHost& message) {
  const std::vector<std::byte> bytes = encode(message);
  while (::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) < 0)
    if (errno != EINTR) ::_exit(0);
}

void serve(int socket, const MakeSource& make) {
  // The library's threads share two heaps. Each further heap would reserve 64 MB of the address space, which is limited
  // below.
  ::mallopt(M_ARENA_MAX, 2);
  for (const Status& limited : {give_up_rights(), limit_memory(kMemoryToConnect)})
    if (!limited) end_as(limited.error().message.c_str(), 1);
  HostLink link(socket);
  const auto end_with = [&link](const Error& error) {
    link.send(Failed{error});
    ::_exit(0);
  };
  auto source = make(link);
  if (!source) end_with(source.error());
  const auto opened = (*source)->open();
  if (link.stop().stop_requested()) ::_exit(kStoppedEarly);  // the last will releases the device
  if (!opened) end_with(opened.error());
  link.allow(kReadsWithin);
  link.send(Running{});
  while (!link.stop().stop_requested()) {
    link.allow(kReadsWithin);
    auto packet = (*source)->next(link.stop());
    if (packet.ok() && packet->kind == PacketKind::Fault) {
      const auto fault = decode_fault(kSystemSensor, packet->received, packet->bytes.bytes());
      if (fault) link.send(Loss{*fault});
    } else if (packet.ok()) {
      const std::uint64_t bytes = packet->bytes.size();
      const HostTime received = packet->received;
      const std::uint32_t slot = link.memory()->hand_out(std::move(packet->bytes));
      link.send(Done{slot, bytes, received});
    } else if (packet.error().code != ErrorCode::TimedOut && packet.error().code != ErrorCode::Stopped) {
      end_with(packet.error());
    }
  }
  (*source)->close();
  ::_exit(0);
}

}  // namespace hueline::drivers::guest
