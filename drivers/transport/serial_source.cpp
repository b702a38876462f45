#include "drivers/transport/serial_source.hpp"

// This file uses the kernel's own termios, because <termios.h> of the C library cannot set an arbitrary baud rate. The
// two headers cannot be mixed.
#include <asm/ioctls.h>
#include <asm/termbits.h>

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace hueline::drivers {

void SerialSource::Config::visit(Keys& keys) {
  keys.text(required("device", "",
                     "The path of the serial port, best a name of /dev/serial/by-id: such a name does not change."),
            device);
  // The fastest adapters (FTDI, Hi-Speed class) reach 12 Mbaud.
  keys.whole(
      required("baud", "1/s", "The port's speed, with 8 data bits, no parity, one stop bit and no flow control."), baud,
      {300, 12'000'000});
}

KeyError SerialSource::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (device.empty()) return not_allowed("device", "empty", "a path such as /dev/ttyUSB0");
  return {"", stream.validate()};
}

SerialSource::SerialSource(Config config) : ByteStreamSource(config.stream), config_(std::move(config)) {}

std::string SerialSource::name() const { return fmt::format("serial {} at {} baud", config_.device, config_.baud); }

Result<int> SerialSource::connect() {
  if (const std::string wrong = config_.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  const int fd = ::open(config_.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) {
    const char* hint = errno == EACCES ? " (is the user in the group dialout?)" : "";
    return Error{ErrorCode::Unavailable, fmt::format("{}: {}{}", name(), std::strerror(errno), hint)};
  }
  const auto refuse = [&](ErrorCode code, const char* attempted) {
    const int error = errno;
    ::close(fd);
    return Error{code, fmt::format("{}: {}: {}", name(), attempted, std::strerror(error))};
  };
  termios2 settings{};
  if (::ioctl(fd, TCGETS2, &settings) < 0) return refuse(ErrorCode::Invalid, "not a serial port");
  settings.c_iflag = IGNBRK;  // bytes unchanged: no XON/XOFF, no CR/LF conversion, no parity marks
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER | (BOTHER << IBSHIFT);
  settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(config_.baud);
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (::ioctl(fd, TCSETS2, &settings) < 0) return refuse(ErrorCode::Unavailable, "setting raw 8N1");
  // Exclusive use: two programs that read the same port would each get half of the bytes.
  (void)::ioctl(fd, TIOCEXCL);
  // Discard the bytes that the driver already holds, because their arrival time is not known.
  (void)::ioctl(fd, TCFLSH, TCIFLUSH);
  // Without this flag, FTDI adapters hold bytes back for up to 16 ms. Other adapters ignore it.
  serial_struct line{};
  if (::ioctl(fd, TIOCGSERIAL, &line) == 0) {
    line.flags |= ASYNC_LOW_LATENCY;
    (void)::ioctl(fd, TIOCSSERIAL, &line);
  }
  return fd;
}

}  // namespace hueline::drivers
