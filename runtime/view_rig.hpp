#pragma once

#include "config/rig.hpp"
#include "storage/view_messages.hpp"

namespace hueline::runtime {

/// Returns what the vehicle carries, as the view and the live feed show it.
storage::ViewRig view_rig(const config::Rig& rig);

}  // namespace hueline::runtime
