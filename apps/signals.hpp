#pragma once

#include <chrono>

namespace hueline::apps {

/// SIGINT and SIGTERM as something to wait for, not something that interrupts. Construct it before any thread starts: the threads
/// inherit the block. One instance a process.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// True if a signal came within `time`.
  bool wait_for(std::chrono::milliseconds time);
};

}  // namespace hueline::apps
