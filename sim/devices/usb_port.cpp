#include "sim/devices/usb_port.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <utility>

#include "sim/devices/big_endian.hpp"

namespace hueline::sim {
namespace {

constexpr const char* kController = "/sys/devices/platform/vhci_hcd.0";
constexpr int kUsbSuperSpeed = 5, kPortIsFree = 4;
constexpr int kSocketBytes = 4 << 20;
constexpr std::size_t kLargestOut = 1 << 20;  // nobody sends so much to a camera

// Messages of USB/IP: 48 bytes, big endian.
constexpr std::size_t kMessageBytes = 48;
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4;

// Standard requests (USB 3.2, table 9-5), in bRequest.
constexpr std::uint8_t kGetStatus = 0, kClearFeature = 1, kSetFeature = 3, kGetDescriptor = 6, kGetConfiguration = 8,
                       kSetConfiguration = 9, kGetInterface = 10, kSetInterface = 11, kSetSel = 48, kSetIsochDelay = 49;
constexpr std::uint8_t kToEndpoint = 2;

/// Returns the number of a port of the controller's SuperSpeed hub that nothing is plugged into, or -1.
int free_port() {
  std::ifstream status(fmt::format("{}/status", kController));
  std::string line;
  while (std::getline(status, line)) {
    char hub[8];
    int port = 0, state = 0;
    if (std::sscanf(line.c_str(), "%7s %d %d", hub, &port, &state) == 3 && hub[0] == 's' && state == kPortIsFree)
      return port;
  }
  return -1;
}

bool read_all(int socket, std::span<std::byte> out) {
  while (!out.empty()) {
    const ssize_t n = ::recv(socket, out.data(), out.size(), 0);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    out = out.subspan(static_cast<std::size_t>(n));
  }
  return true;
}

Bytes answer_head(std::uint32_t command, std::uint32_t sequence, int error, std::size_t size) {
  Bytes out;
  put_be32(out, command);
  put_be32(out, sequence);
  for (int i = 0; i < 3; ++i) put_be32(out, 0);  // device, direction and endpoint are not read in answers
  put_be32(out, static_cast<std::uint32_t>(error));
  put_be32(out, static_cast<std::uint32_t>(size));
  out.resize(kMessageBytes);
  return out;
}

}  // namespace

struct UsbPort::Request {
  std::uint32_t sequence = 0;
  std::uint8_t endpoint = 0;
  bool is_in = false;
  std::uint32_t size = 0;
  std::array<std::byte, 8> setup{};  // of a control transfer
};

Result<std::unique_ptr<UsbPort>> UsbPort::plug(UsbDevice& device) {
  std::array<int, 2> pair{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0)
    return io_error("make a socket pair for a USB port", errno);
  FileDescriptor ours(pair[0]), kernels(pair[1]);
  for (const int socket : pair)  // larger than the usual limit if this program may; else transfers are slower
    for (const int option : {SO_SNDBUFFORCE, SO_RCVBUFFORCE})
      ::setsockopt(socket, SOL_SOCKET, option, &kSocketBytes, sizeof(kSocketBytes));
  std::unique_ptr<UsbPort> made(new UsbPort(device, std::move(ours)));

  const FileDescriptor attach(::open(fmt::format("{}/attach", kController).c_str(), O_WRONLY | O_CLOEXEC));
  for (int refusals = 0;; ++refusals) {
    const int port = free_port();
    if (port < 0)
      return Error{
          ErrorCode::Unavailable,
          fmt::format("{} has no free SuperSpeed port; `modprobe vhci_hcd` makes the controller", kController)};
    const std::string order = fmt::format("{} {} {} {}", port, kernels.get(), 0x10002 + port, kUsbSuperSpeed);
    if (attach && ::write(attach.get(), order.data(), order.size()) == static_cast<ssize_t>(order.size())) return made;
    // Another program may have taken the port since it was found free.
    constexpr int kMostRefusals = 20;
    if (attach && errno == EBUSY && refusals < kMostRefusals) continue;
    Error error = io_error("attach a device to the virtual USB controller", errno);
    error.code = ErrorCode::Unavailable;
    return error;
  }
}

UsbPort::UsbPort(UsbDevice& device, FileDescriptor socket)
    : device_(device), socket_(std::move(socket)), thread_([this] { run(); }) {}

UsbPort::~UsbPort() { unplug(); }

void UsbPort::unplug() {
  {
    Lock lock(mutex_);
    is_plugged_ = false;
    ::shutdown(socket_.get(), SHUT_RDWR);
  }
  changed_.notify_all();
}

bool UsbPort::is_plugged() const {
  Lock lock(mutex_);
  return is_plugged_;
}

void UsbPort::send(std::uint8_t endpoint, Buffer bytes) {
  Lock lock(mutex_);
  Endpoint& in = in_[endpoint & 15U];
  if (!is_plugged_ || in.is_halted || bytes.empty()) return;
  in.waiting.push_back({std::move(bytes), 0});
  serve(in);
}

bool UsbPort::wait_until_taken(std::uint8_t endpoint, const std::stop_token& stop) {
  Lock lock(mutex_);
  Endpoint& in = in_[endpoint & 15U];
  const std::uint64_t drops = in.drops;
  const auto is_over = [&]() HUELINE_REQUIRES(mutex_) {
    // What waits after serve() although a transfer is under way has gone over the wire: that transfer holds it, and
    // waits for more.
    const bool is_taken = in.waiting.empty() || (!in.requests.empty() && !in.is_halted);
    return is_taken || !is_plugged_ || in.drops != drops;
  };
  return changed_.wait(lock, stop, is_over) && is_plugged_ && in.drops == drops;
}

void UsbPort::drop(std::uint8_t endpoint) {
  {
    Lock lock(mutex_);
    Endpoint& in = in_[endpoint & 15U];
    in.waiting.clear();
    ++in.drops;
  }
  changed_.notify_all();
}

void UsbPort::stall(std::uint8_t endpoint) { reset(endpoint, true); }

bool UsbPort::is_halted(std::uint8_t endpoint) const {
  Lock lock(mutex_);
  return in_[endpoint & 15U].is_halted;
}

void UsbPort::reset(std::uint32_t address, bool is_halted) {
  {
    Lock lock(mutex_);
    Endpoint& in = in_[address & 15U];
    in.is_halted = is_halted;
    in.waiting.clear();
    ++in.drops;
    serve(in);
  }
  changed_.notify_all();
}

void UsbPort::run() {
  while (take_message()) continue;
  unplug();
}

bool UsbPort::take_message() {
  std::array<std::byte, kMessageBytes> head;
  if (!read_all(socket_.get(), head)) return false;
  const std::uint32_t command = get_be32(head, 0), sequence = get_be32(head, 4);
  if (command == kUnlink) {
    unlink(sequence, get_be32(head, 20));
    return true;
  }
  if (command != kSubmit) return false;
  Request request;
  request.sequence = sequence;
  request.is_in = get_be32(head, 12) != 0;
  request.endpoint = static_cast<std::uint8_t>(get_be32(head, 16) & 15U);
  request.size = get_be32(head, 24);
  std::copy_n(head.begin() + 40, request.setup.size(), request.setup.begin());
  Bytes out(request.is_in ? 0 : request.size);
  if (out.size() > kLargestOut || !read_all(socket_.get(), out)) return false;
  submit(request, out);
  return true;
}

void UsbPort::submit(Request request, std::span<const std::byte> bytes) {
  if (request.endpoint == 0) return control(request, bytes);
  if (!request.is_in) {
    {
      Lock lock(mutex_);
      complete(request, 0, std::array{bytes});
    }
    return device_.receive(request.endpoint, bytes);
  }
  {
    Lock lock(mutex_);
    Endpoint& in = in_[request.endpoint];
    in.requests.push_back(request);
    serve(in);
  }
  changed_.notify_all();
}

void UsbPort::serve(Endpoint& endpoint) {
  while (!endpoint.requests.empty()) {
    const Request& request = endpoint.requests.front();
    if (endpoint.is_halted) {
      complete(request, EPIPE, {});
      endpoint.requests.pop_front();
      continue;
    }
    std::size_t left = request.size, used_up = 0;
    bool is_short = false;
    std::vector<std::span<const std::byte>> parts;
    for (const Waiting& piece : endpoint.waiting) {
      parts.push_back(piece.bytes.bytes().subspan(piece.taken, std::min(left, piece.bytes.size() - piece.taken)));
      left -= parts.back().size();
      if (piece.taken + parts.back().size() < piece.bytes.size()) break;
      ++used_up;
      is_short = piece.bytes.size() % kPacketBytes != 0;
      if (is_short || left == 0) break;
    }
    if (left > 0 && !is_short) return;
    std::size_t of_last = parts.empty() ? 0 : parts.back().size();
    const bool is_inside_piece = used_up < parts.size();
    if (is_inside_piece) {
      // A packet for which there is no room is an error, and its rest is lost.
      Waiting& piece = endpoint.waiting[used_up];
      const std::size_t cut = (piece.taken + of_last) % kPacketBytes;
      complete(request, cut == 0 ? 0 : EOVERFLOW, parts);
      if (cut != 0) of_last = std::min(of_last + kPacketBytes - cut, piece.bytes.size() - piece.taken);
      piece.taken += of_last;
      if (piece.taken == piece.bytes.size()) ++used_up;
    } else {
      complete(request, 0, parts);
    }
    endpoint.waiting.erase(endpoint.waiting.begin(), endpoint.waiting.begin() + static_cast<std::ptrdiff_t>(used_up));
    endpoint.requests.pop_front();
  }
}

void UsbPort::unlink(std::uint32_t sequence, std::uint32_t unlinked) {
  {
    Lock lock(mutex_);
    for (Endpoint& endpoint : in_) {
      const auto found = std::ranges::find(endpoint.requests, unlinked, &Request::sequence);
      if (found == endpoint.requests.end()) continue;
      // Only the first request has received anything.
      std::vector<std::span<const std::byte>> parts;
      if (found == endpoint.requests.begin())
        for (const Waiting& piece : endpoint.waiting) parts.push_back(piece.bytes.bytes().subspan(piece.taken));
      complete(*found, ECONNRESET, parts);
      if (!parts.empty()) endpoint.waiting.clear();
      endpoint.requests.erase(found);
      break;
    }
    write(answer_head(kUnlinked, sequence, 0, 0), {});
  }
  changed_.notify_all();
}

void UsbPort::complete(const Request& request, int error, std::span<const std::span<const std::byte>> parts) {
  std::size_t size = 0;
  for (const auto& part : parts) size += part.size();
  const Bytes head = answer_head(kSubmitted, request.sequence, -error, size);
  write(head, request.is_in ? parts : decltype(parts)());
}

void UsbPort::write(std::span<const std::byte> head, std::span<const std::span<const std::byte>> parts) {
  if (!is_plugged_) return;
  std::vector<iovec> pieces;
  const auto add = [&](std::span<const std::byte> bytes) {
    if (!bytes.empty()) pieces.push_back({const_cast<std::byte*>(bytes.data()), bytes.size()});
  };
  add(head);
  for (const auto& part : parts) add(part);
  for (std::size_t first = 0; first < pieces.size();) {
    msghdr message{};
    message.msg_iov = &pieces[first];
    message.msg_iovlen = std::min<std::size_t>(pieces.size() - first, IOV_MAX);
    const ssize_t n = ::sendmsg(socket_.get(), &message, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return;  // the kernel has let the device go; reading from the socket says so too
    for (auto sent = static_cast<std::size_t>(n); sent > 0;) {
      const std::size_t part = std::min(sent, pieces[first].iov_len);
      pieces[first].iov_base = static_cast<char*>(pieces[first].iov_base) + part;
      pieces[first].iov_len -= part;
      sent -= part;
      if (pieces[first].iov_len == 0) ++first;
    }
  }
}

void UsbPort::control(const Request& request, std::span<const std::byte> bytes) {
  Result<Bytes> data = answer_control(request, bytes);
  Lock lock(mutex_);
  if (!data) return complete(request, EPIPE, {});
  if (request.is_in && data->size() > request.size) data->resize(request.size);
  // A request that writes ends with the number of bytes that were taken.
  complete(request, 0, std::array{request.is_in ? std::span<const std::byte>(*data) : bytes});
}

Result<Bytes> UsbPort::answer_control(const Request& request, std::span<const std::byte> bytes) {
  const auto byte = [&](std::size_t at) { return std::to_integer<std::uint8_t>(request.setup[at]); };
  const std::uint8_t type = byte(0), number = byte(1);
  const std::uint32_t value = byte(2) | std::uint32_t{byte(3)} << 8U, index = byte(4);
  const Error refused{ErrorCode::Unsupported, "the device has no such request"};
  constexpr std::uint8_t kOfMaker = 0x40, kOfClass = 0x20, kToHost = 0x80;
  if ((type & kOfMaker) != 0)
    return device_.answer({.is_read = (type & kToHost) != 0,
                           .number = number,
                           .value = static_cast<std::uint16_t>(value),
                           .index = static_cast<std::uint16_t>(index | std::uint32_t{byte(5)} << 8U),
                           .data = bytes});
  if ((type & kOfClass) != 0) return refused;
  switch (number) {
    case kGetStatus:
      return Bytes(2);
    case kClearFeature:
    case kSetFeature:
      if ((type & 31U) == kToEndpoint && value == 0) {  // ENDPOINT_HALT
        reset(index, number == kSetFeature);
        device_.endpoint_was_reset(static_cast<std::uint8_t>(index & 15U));
      }
      return Bytes();
    case kGetDescriptor: {
      Bytes found = descriptor(value >> 8U, value & 0xffU);
      if (found.empty()) return refused;
      return found;
    }
    case kGetConfiguration:
      return Bytes{static_cast<std::byte>(configuration_)};
    case kSetConfiguration:
      configuration_ = static_cast<std::uint8_t>(value);
      return Bytes();
    case kGetInterface:
      return Bytes(1);
    case kSetInterface:
    case kSetSel:
    case kSetIsochDelay:
      return Bytes();
    default:
      return refused;
  }
}

Bytes UsbPort::descriptor(std::uint32_t type, std::uint32_t number) const {
  const UsbDescriptors& all = device_.descriptors();
  switch (type) {
    case 1:
      return all.device;
    case 2:
      return all.configuration;
    case 3: {
      LittleEndianWriter out(64);
      if (number > all.strings.size()) return {};
      const std::string& text = number == 0 ? std::string() : all.strings[number - 1];
      out.put(static_cast<std::uint8_t>(number == 0 ? 4 : 2 + 2 * text.size()));
      out.put(std::uint8_t{3});
      if (number == 0) out.put(std::uint16_t{0x0409});  // the only language: English
      for (const char c : text) out.put(static_cast<std::uint16_t>(c));
      return out.take();
    }
    case 15:
      return all.capabilities;
    default:
      return {};
  }
}

}  // namespace hueline::sim
