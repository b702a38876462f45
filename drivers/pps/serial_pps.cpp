#include "drivers/pps/serial_pps.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/tty.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace hueline::drivers {

Result<std::string> find_pps_of(const std::string& port, const std::string& sysfs) {
  // The kernel names the port as its driver does, "ttyS0"; `port` may be a link to it.
  std::error_code error;
  const auto real = std::filesystem::canonical(port, error);
  const std::string wanted = (error ? std::filesystem::path(port) : real).filename().string();
  for (std::filesystem::directory_iterator entry(sysfs, error), end; !error && entry != end; entry.increment(error)) {
    std::ifstream file(entry->path() / "path");
    std::string path;
    if (std::getline(file, path) && std::filesystem::path(path).filename().string() == wanted)
      return "/dev/" + entry->path().filename().string();
  }
  return Error{ErrorCode::Unavailable, fmt::format("{}: the kernel made no PPS device for it in {}", port, sysfs)};
}

Status SerialPps::open() {
  close();
  tty_ = FileDescriptor(::open(port_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!tty_) {
    const int error = errno;
    return Error{ErrorCode::Unavailable, fmt::format("open {}: {}", port_, std::strerror(error))};
  }
  const int discipline = N_PPS;
  if (::ioctl(tty_.get(), TIOCSETD, &discipline) != 0) {
    const int error = errno;
    close();
    return Error{ErrorCode::Unavailable,
                 fmt::format("{}: line discipline for pulses: {}{}", port_, std::strerror(error),
                             error == EINVAL || error == EPERM ? " (load it: modprobe pps_ldisc)" : "")};
  }
  auto device = find_pps_of(port_);
  Status opened;
  if (device.ok()) {
    pps_ = std::make_unique<KernelPps>(*device, edge_);
    opened = pps_->open();
  } else {
    opened = device.error();
  }
  if (!opened.ok()) close();
  return opened;
}

Result<Packet> SerialPps::next(std::stop_token stop) {
  if (!pps_) return Error{ErrorCode::Disconnected, port_ + " is not open"};
  return pps_->next(std::move(stop));
}

void SerialPps::close() {
  pps_.reset();
  tty_ = {};  // the port gets its usual discipline back
}

}  // namespace hueline::drivers
