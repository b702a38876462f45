#pragma once

namespace hueline::drivers {

/// Ingest sets the arrival of an edge or of a reading whose own stamp is impossible. A difference above this says that
/// it did: far above the rounding of the difference, far below what Ingest corrects.
constexpr double kReceivedAsStamped_s = 1e-3;

}  // namespace hueline::drivers
