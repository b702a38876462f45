#include "drivers/pps/gpio_pps.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/gpio.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>

#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {
namespace {

constexpr int kWaitMs = 100;

}  // namespace

Result<FileDescriptor> request_gpio_edges(const GpioLine& line, PpsEdgeKind edge) {
  const FileDescriptor chip(::open(line.chip.c_str(), O_RDONLY | O_CLOEXEC));
  if (!chip) {
    const int error = errno;
    return Error{ErrorCode::Unavailable, fmt::format("open {}: {}", line.chip, std::strerror(error))};
  }
  gpio_v2_line_request request{};
  request.offsets[0] = line.line;
  request.num_lines = 1;
  constexpr std::string_view consumer = "hueline pps";
  std::memcpy(request.consumer, consumer.data(), consumer.size());
  request.config.flags = GPIO_V2_LINE_FLAG_INPUT |
                         (edge == PpsEdgeKind::Assert ? GPIO_V2_LINE_FLAG_EDGE_RISING : GPIO_V2_LINE_FLAG_EDGE_FALLING);
  if (::ioctl(chip.get(), GPIO_V2_GET_LINE_IOCTL, &request) != 0) {
    const int error = errno;
    const char* what = error == EBUSY    ? " (another program or driver uses the line: gpioinfo names it)"
                       : error == EINVAL ? " (no such line)"
                       : error == ENXIO  ? " (the line has no interrupt)"
                                         : "";
    return Error{ErrorCode::Unavailable, fmt::format("line {} of {}, edges of {}: {}{}", line.line, line.chip,
                                                     drivers::name(edge), std::strerror(error), what)};
  }
  return FileDescriptor(request.fd);
}

std::string GpioPps::name() const { return fmt::format("line {} of {}", line_.line, line_.chip); }

Status GpioPps::open() {
  close();
  auto events = request_(line_, edge_);
  if (!events.ok()) return events.error();
  events_ = std::move(events).value();
  last_sequence_ = 0;
  return {};
}

Result<Packet> GpioPps::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (!events_) return Error{ErrorCode::Disconnected, name() + " is not open"};
  pollfd readable{events_.get(), POLLIN, 0};
  const int ready = ::poll(&readable, 1, kWaitMs);
  if (ready == 0 || (ready < 0 && errno == EINTR)) return Error{ErrorCode::TimedOut, {}};
  gpio_v2_line_event event{};
  const ssize_t size = ready < 0 ? -1 : ::read(events_.get(), &event, sizeof event);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return Error{ErrorCode::TimedOut, {}};
  if (size != static_cast<ssize_t>(sizeof event)) {
    const std::string why = size < 0 ? std::strerror(errno) : size == 0 ? "the chip is gone" : "half an event";
    close();
    return Error{ErrorCode::Disconnected, name() + ": " + why};
  }
  // The kernel counts the edges of a line from 1 on, in 32 bits. Its buffer drops the oldest if nobody reads.
  sequence_ += static_cast<std::uint32_t>(event.line_seqno - last_sequence_);
  last_sequence_ = event.line_seqno;
  const HostTime edge =
      to_host_time(nanoseconds(static_cast<std::int64_t>(event.timestamp_ns)), KernelClock::Monotonic);
  const PpsEdgeKind kind = event.id == GPIO_V2_LINE_EVENT_FALLING_EDGE ? PpsEdgeKind::Clear : PpsEdgeKind::Assert;
  return Packet{kSystemSensor, PacketKind::Wire, false, 0, edge, Buffer::copy_of(encode_pps({kind, sequence_, edge}))};
}

}  // namespace hueline::drivers
