#pragma once

#include <stop_token>
#include <string>

#include "apps/command_line.hpp"
#include "apps/signals.hpp"
#include "runtime/recording.hpp"

namespace hueline::apps {

/// The work of a command with `--follow`, on a recording that a capture is writing. Construct it before any thread: it
/// lets the capture have the processors first, and a first Ctrl-C ends what the command follows, not the command.
class Following {
 public:
  Following();
  /// Declares `--follow`. `before` begins its help.
  static void declare(Command& command, bool& follows, const std::string& before = {});

  std::stop_token asked() const { return signals_.asked(); }
  /// Warns of segments that a ring had removed before they were read. Returns whether there were some.
  static bool tell_missed(const runtime::Recording& recording);

 private:
  StopSignals signals_;
};

}  // namespace hueline::apps
