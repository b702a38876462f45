#pragma once

#include "config/section.hpp"
#include "core/fault.hpp"
#include "sync/synchroniser.hpp"

/// What each sensor of a rig means for the clocks: keys of the sensor's own mapping, put into the synchroniser's Config.
namespace hueline::config {

void add_laser(SensorId id, sync::Synchroniser::Config& sync);
void add_profile_scanner(SensorId id, sync::Synchroniser::Config& sync);
void add_pos(const Section& sensor, SensorId id, sync::Synchroniser::Config& sync);
/// Keys event_input, strobe_delay_us, mark_sigma_us, has_counter, counter_wraps_s, counter_offset_s, stamp_event, stamp_delay_us,
/// latency_min_ms, latency_max_ms.
void add_camera(Section& sensor, SensorId id, nanoseconds exposure, sync::Synchroniser::Config& sync);
/// Key edge_delay_us.
void add_pps(Section& sensor, SensorId id, sync::Synchroniser::Config& sync);
/// Keys stamp_delay_us, stamp_sigma_us, age_ms.
void add_wheel(Section& sensor, SensorId id, sync::Synchroniser::Config& sync);
/// The rig's `time` section: what belongs to no single sensor.
void read_time(Section section, sync::Synchroniser::Config& sync);

}  // namespace hueline::config
