#include "drivers/transport/usb_memory.hpp"

#include <fmt/format.h>

#include <fstream>

namespace hueline::drivers {

std::string hint_at_usb_memory() {
  constexpr const char* kLimit = "/sys/module/usbcore/parameters/usbfs_memory_mb";
  constexpr int kEnough_MB = 256;
  int megabytes = 0;  // 0: no limit
  if (!(std::ifstream(kLimit) >> megabytes) || megabytes == 0 || megabytes >= kEnough_MB) return {};
  return fmt::format("; all USB cameras together have {} MB for their transfers: `echo 1000 > {}` gives them more",
                     megabytes, kLimit);
}

}  // namespace hueline::drivers
