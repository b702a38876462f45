#pragma once

#include <optional>
#include <string>
#include <utility>

#include "core/result.hpp"
#include "drivers/can/can_log_entry.hpp"
#include "drivers/transport/capture_file.hpp"

namespace hueline::drivers {

/// Reads the frames of CAN buses in a capture file, as Wireshark and tcpdump write it on `can0` (link type 227) or on
/// `any` (Linux cooked, 113 and 276). Frames of networks in between are passed over. `interface` of an entry is the
/// name or the number of the interface, where the file has one.
/// Thread safety: none; one thread reads one file.
/// Source: the description of LINKTYPE_CAN_SOCKETCAN, LINKTYPE_LINUX_SLL and LINKTYPE_LINUX_SLL2 by the makers of
/// tcpdump.
class CanCapture {
 public:
  /// Messages call the file `name`.
  CanCapture(CaptureFile file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}

  /// Returns the next frame, with its time since 1970, or nothing at the end. Errors: Malformed and Truncated, after
  /// which the next call goes on where that is possible; Io.
  Result<std::optional<CanLogEntry>> next();

 private:
  CaptureFile file_;
  std::string name_;
  bool is_ended_ = false;
};

/// Returns whether a file is a capture whose first frame is one of a CAN bus.
bool is_can_capture(const std::string& path);

}  // namespace hueline::drivers
