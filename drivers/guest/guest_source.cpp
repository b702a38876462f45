#include "drivers/guest/guest_source.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {

using namespace guest;

namespace {

constexpr int kWaitMs = 100;
constexpr std::chrono::milliseconds kReapedWithin{1000};
constexpr int kMostLossesASecond = 20;
constexpr int kWillTries = 3, kWillAnswerMs = 50;

sockaddr_in address(const std::array<std::uint8_t, 4>& bytes, std::uint16_t port) {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  std::memcpy(&out.sin_addr, bytes.data(), bytes.size());
  out.sin_port = htons(port);
  return out;
}

}  // namespace

Status GuestSource::open() {
  if (!guest_)
    if (const Status started = start(); !started) return started;
  auto event = wait_for_event();
  if (event.ok()) {
    if (std::holds_alternative<Running>(*event)) return {};
    return broken("it sent a packet before it was running");
  }
  Error error = event.error();
  // For the caller of open() it is the same whether the device was not found or was lost again.
  if (error.code == ErrorCode::Disconnected) error.code = ErrorCode::Unavailable;
  return error;
}

Status GuestSource::start() {
  auto process = GuestProcess::start(config_.program);
  if (!process) return process.error();
  guest_.emplace(std::move(process).value());
  will_.reset();
  is_handed_over_ = false;
  was_heard_ = false;
  started_ = heard_ = host_now();
  message_.resize(kMostMessageBytes);
  if (const Status sent = send(guest::Config{config_.driver, config_.text}); !sent) return broken(sent.error().message);
  return {};
}

Result<Packet> GuestSource::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (!guest_) return Error{ErrorCode::Disconnected, "not open"};
  auto event = wait_for_event();
  if (!event) return event.error();
  if (auto* packet = std::get_if<Packet>(&*event)) return std::move(*packet);
  return broken("it said twice that it is running");
}

Result<GuestSource::Event> GuestSource::wait_for_event() {
  const HostTime end = host_now() + std::chrono::milliseconds(kWaitMs);
  for (;;) {
    give_back_returned();
    pollfd readable{guest_->socket(), POLLIN, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - host_now()).count();
    const int ready = ::poll(&readable, 1, static_cast<int>(std::clamp<std::int64_t>(left, 0, kWaitMs)));
    guest_->listen();
    if (ready > 0) {
      const ssize_t size = ::recv(guest_->socket(), message_.data(), message_.size(), MSG_DONTWAIT);
      if (size < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (size <= 0) return died();
      heard_ = host_now();
      was_heard_ = true;
      auto message = decode_for_host(std::span(message_).first(static_cast<std::size_t>(size)));
      if (!message) return broken(message.error().message);
      auto event = handle(*message);
      if (!event) return event.error();
      if (*event) return std::move(**event);
      if (heard_ >= end) return Error{ErrorCode::TimedOut, {}};
      continue;
    }
    const HostTime now = host_now();
    const auto limit = was_heard_ ? config_.hung_after : config_.started_within;
    if (now - heard_ > limit) return broken(fmt::format("it has said nothing for {} ms, so it hangs", limit.count()));
    if (now >= end) return Error{ErrorCode::TimedOut, {}};
  }
}

Result<std::optional<GuestSource::Event>> GuestSource::handle(ToHost& message) {
  using Outcome = Result<std::optional<Event>>;
  using Nothing = std::optional<Event>;
  return std::visit(
      guest::Overloaded{
          [](Alive&) -> Outcome { return Nothing(); },
          [this](LastWill& will) -> Outcome {
            will_ = std::move(will);
            return Nothing();
          },
          [this](NeedMemory& need) -> Outcome {
            if (const Status given = give_memory(need.packet_bytes); !given) return broken(given.error().message);
            return Nothing();
          },
          [](Running&) -> Outcome { return Nothing(Running{}); },
          [this](Done& done) -> Outcome {
            if (!is_possible(done.received))
              return broken("it stamped a packet with a time at which it cannot have come");
            Buffer bytes = is_handed_over_ ? memory_->lend(done.slot, done.bytes) : Buffer();
            if (bytes.empty())
              return broken(fmt::format("it gave {} bytes in slot {}, which is not so", done.bytes, done.slot));
            return Nothing(Packet{kSystemSensor, PacketKind::Wire, false, 0, done.received, std::move(bytes)});
          },
          [this](Loss& loss) -> Outcome {
            if (!is_possible(loss.fault.time))
              return broken("it stamped a loss with a time at which it cannot have been seen");
            if (heard_ - losses_since_ > std::chrono::seconds(1)) {
              losses_since_ = heard_;
              losses_ = 0;
            }
            if (++losses_ > kMostLossesASecond)
              return broken(fmt::format("it told of more than {} losses a second", kMostLossesASecond));
            return Nothing(Packet{kSystemSensor, PacketKind::Fault, false, 0, loss.fault.time,
                                  Buffer::copy_of(encode_fault(loss.fault))});
          },
          [this](Failed& failed) -> Outcome {
            Error error = std::move(failed.error);
            guest_->kill();  // it is already ending by itself
            execute_will();
            reap();
            // A guest may not return these codes, because they end a reader without a message.
            if (error.code == ErrorCode::TimedOut || error.code == ErrorCode::Stopped ||
                error.code == ErrorCode::EndOfData)
              error.code = ErrorCode::Disconnected;
            return error;
          },
      },
      message);
}

// Both processes have the same clock, so a stamp must lie between the guest's start and now.
bool GuestSource::is_possible(HostTime stamp) const { return stamp >= started_ && stamp <= host_now(); }

Status GuestSource::give_memory(std::uint64_t packet_bytes) {
  if (is_handed_over_) return Error{ErrorCode::Malformed, "it asked twice for memory"};
  if (!memory_ || memory_->slot_bytes() < packet_bytes || memory_->slot_bytes() - packet_bytes >= 4096) {
    auto made = SlotMemory::create(packet_bytes, config_.slots);
    if (!made) return made.error();
    memory_ = std::move(made).value();
  }
  // The slots that are still read here are given to the guest when they come back.
  std::vector<std::uint32_t> free = memory_->hand_over();
  is_handed_over_ = true;
  if (const Status sent =
          send(Memory{memory_->slot_bytes(), static_cast<std::uint32_t>(memory_->slots())}, memory_->fd());
      !sent)
    return sent;
  return send(GiveBack{std::move(free)});
}

Status GuestSource::send(const ToGuest& message, int descriptor) {
  std::vector<std::byte> bytes = encode(message);
  iovec part{bytes.data(), bytes.size()};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  if (descriptor >= 0) {
    header.msg_control = control.data();
    header.msg_controllen = control.size();
    cmsghdr* rights = CMSG_FIRSTHDR(&header);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(rights), &descriptor, sizeof(int));
  }
  // Never wait for a guest: one that does not read hangs.
  if (::sendmsg(guest_->socket(), &header, MSG_DONTWAIT | MSG_NOSIGNAL) < 0)
    return io_error("speak to the guest", errno);
  return {};
}

void GuestSource::give_back_returned() {
  if (!is_handed_over_) return;
  std::vector<std::uint32_t> returned = memory_->take_returned();
  // If the guest does not take them, it hangs or is dead, which shows elsewhere. Its successor gets them.
  if (!returned.empty()) (void)send(GiveBack{std::move(returned)});
}

Error GuestSource::broken(const std::string& why) {
  guest_->kill();
  execute_will();
  reap();
  return {ErrorCode::Disconnected,
          fmt::format("{}: {}; it was ended and is started again", config_.program.filename().string(), why)};
}

Error GuestSource::died() {
  // Its socket is closed, but the process may need a moment to end.
  if (!guest_->wait(kReapedWithin)) return broken("it hung up");
  std::string how = guest_->end();
  execute_will();
  reap();
  return {ErrorCode::Disconnected,
          fmt::format("{}: {}; it is started again", config_.program.filename().string(), how)};
}

// The dead guest's port must be free, so that the device takes the datagram for the guest's own.
void GuestSource::execute_will() {
  if (!will_) return;
  const LastWill will = *std::exchange(will_, std::nullopt);
  if (!guest_->wait(kReapedWithin)) return;
  const FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const sockaddr_in from = address(will.from, will.from_port), to = address(will.to, will.to_port);
  if (!socket || ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&from), sizeof(from)) != 0 ||
      ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof(to)) != 0)
    return;  // the device then waits for its own timeout, as without a last will
  for (int i = 0; i < kWillTries; ++i) {
    if (::send(socket.get(), will.datagram.data(), will.datagram.size(), MSG_NOSIGNAL) < 0) continue;
    pollfd answered{socket.get(), POLLIN, 0};
    if (::poll(&answered, 1, kWillAnswerMs) > 0) return;
  }
}

void GuestSource::reap() {
  // A process that the kernel still holds may go on writing, so nobody else may use its memory.
  if (!guest_->wait(kReapedWithin)) memory_.reset();
  guest_.reset();
}

void GuestSource::close() {
  if (!guest_) return;
  (void)send(Stop{});
  const HostTime end = host_now() + config_.stop_within;
  bool hung_up = false;
  // Its last messages are not used. They are read so that the guest is not blocked.
  while (!hung_up && host_now() < end) {
    pollfd readable{guest_->socket(), POLLIN, 0};
    if (::poll(&readable, 1, 10) > 0)
      hung_up = ::recv(guest_->socket(), message_.data(), message_.size(), MSG_DONTWAIT) <= 0;
  }
  if (!hung_up || !guest_->wait(kReapedWithin)) guest_->kill();
  if (!guest_->wait(kReapedWithin) || !guest_->has_ended_well()) execute_will();
  reap();
}

}  // namespace hueline::drivers
