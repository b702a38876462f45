#include "apps/following.hpp"

#include "apps/log.hpp"
#include "core/child.hpp"

namespace hueline::apps {
namespace {

StopSignals signals_of_low_priority() {
  give_way();
  return {};
}

}  // namespace

Following::Following() : signals_(signals_of_low_priority()) {}

void Following::declare(Command& command, bool& follows, const std::string& before) {
  command.flag("--follow", follows,
               before + "the recording is one that a capture is writing: work on it as it grows, until the drive ends");
}

bool Following::tell_missed(const runtime::Recording& recording) {
  const std::uint64_t missed = recording.journal->segments_missed();
  if (missed > 0) log_warning("{} segments were not read: the ring of the recording had removed them before", missed);
  return missed > 0;
}

}  // namespace hueline::apps
