#pragma once

#include "config/section.hpp"
#include "core/calibration_record.hpp"

namespace hueline::config {

/// The optional `calibration` mapping beside a calibrated value: checked, so that a rig file says only what can be so, and then left
/// alone. The rig's text, with it, goes into the recording.
void check_calibration_record(Section& parent);

/// The mapping itself.
CalibrationRecord read_calibration_record(Section section);

}  // namespace hueline::config
