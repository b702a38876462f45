#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/merge/merge_plan.hpp"

namespace hueline::apps {

/// Which sensors come from which recording.
struct SensorChoice {
  /// For each recording, by its SensorId: which sensor of the vehicle's rig it becomes; empty: left out. [0] is 0.
  std::vector<std::vector<std::optional<SensorId>>> sensors;
  std::vector<std::string> warnings;
};

/// Decides it by the names of the sensors. A sensor is taken from the recording that has packets of it. Of a PPS and a
/// POS that several recordings have, the first one's is taken, because all of them listen to the same receiver; any
/// other sensor that several have is an error unless the wish says which. But of recordings with the same clock in
/// which the packets of a sensor follow each other, as of one that was cut, all packets are taken. Errors: Invalid.
Result<SensorChoice> choose_sensors(const MergeWish& wish, const std::vector<SurveyedJournal>& journals);

}  // namespace hueline::apps
