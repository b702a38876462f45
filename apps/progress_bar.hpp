#pragma once

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace hueline::apps {

/// Shows the progress of slow work on standard error: a bar on a terminal, otherwise a line for every tenth.
/// Thread safety: none; one thread calls all functions.
class ProgressBar {
 public:
  explicit ProgressBar(bool is_shown = true) : is_shown_(is_shown) {}

  /// Shows the stage of the work and the share of it that is done, 0 ... 1.
  void show(const std::string& stage, double share) {
    if (!is_shown_) return;
    const int tenth = static_cast<int>(share * 10);
    if (is_terminal_) {
      const auto filled = static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * 30);
      std::fprintf(stderr, "\r\033[K%-40s [%-30s] %3.0f %%", stage.c_str(), std::string(filled, '#').c_str(),
                   share * 100);
    } else if (stage != stage_ || tenth != tenth_) {
      std::fprintf(stderr, "%s %.0f %%\n", stage.c_str(), share * 100);
    }
    stage_ = stage;
    tenth_ = tenth;
  }
  /// Removes the bar.
  void end() {
    if (is_terminal_ && !stage_.empty()) std::fputs("\r\033[K", stderr);
    stage_.clear();
  }

 private:
  const bool is_shown_;
  const bool is_terminal_ = isatty(STDERR_FILENO) != 0;
  std::string stage_;
  int tenth_ = -1;
};

}  // namespace hueline::apps
