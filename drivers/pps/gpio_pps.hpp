#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "core/packet.hpp"
#include "drivers/pps/pps_packet.hpp"
#include "drivers/transport/file_descriptor.hpp"

namespace hueline::drivers {

/// A line of a GPIO chip.
struct GpioLine {
  std::string chip = "/dev/gpiochip0";
  std::uint32_t line = 0;  ///< number of the line in the chip, as gpioinfo prints it
};

/// Requests a line as input with events of one edge, from the kernel's GPIO character device (linux/gpio.h, second
/// version). Reading the result gives a gpio_v2_line_event for each edge. Errors: Unavailable (the chip cannot be
/// opened, the line is used by another), with what to do.
Result<FileDescriptor> request_gpio_edges(const GpioLine& line, PpsEdgeKind edge);

/// Reads PPS edges from a GPIO line. PpsSource says what it promises. The kernel stamps an edge in its interrupt
/// handler, on CLOCK_MONOTONIC, which never steps. `assert` is the rising edge.
class GpioPps final : public PacketSource {
 public:
  using Request = std::function<Result<FileDescriptor>(const GpioLine&, PpsEdgeKind)>;

  /// `request` opens the line; a test passes its own.
  GpioPps(GpioLine line, PpsEdgeKind edge, Request request = request_gpio_edges)
      : line_(std::move(line)), edge_(edge), request_(std::move(request)) {}

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override { events_ = {}; }

 private:
  std::string name() const;

  const GpioLine line_;
  const PpsEdgeKind edge_;
  const Request request_;
  FileDescriptor events_;
  std::uint32_t last_sequence_ = 0;  // as the kernel counts, in 32 bits
  std::uint64_t sequence_ = 0;       // the same without wrapping
};

}  // namespace hueline::drivers
