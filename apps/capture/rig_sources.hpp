#pragma once

#include <vector>

#include "config/rig.hpp"
#include "core/buffer.hpp"
#include "runtime/live_run.hpp"

namespace hueline::apps {

/// Returns where the packets of a rig's sensors come from, and how each is read: devices each by itself; files of
/// recorded sensors side by side, in the order of the times that the devices wrote.
std::vector<runtime::LiveRun::Source> sources_of(const config::Rig& rig, const BufferPool& pool);

}  // namespace hueline::apps
