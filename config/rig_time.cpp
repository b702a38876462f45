#include "config/rig_time.hpp"

#include "core/calendar.hpp"

namespace hueline::config {
namespace {

nanoseconds microseconds_of(double us) { return from_seconds(us * 1e-6); }
double us(nanoseconds d) { return to_seconds(d) * 1e6; }
double ms(nanoseconds d) { return to_seconds(d) * 1e3; }

}  // namespace

void add_laser(SensorId id, sync::Synchroniser::Config& sync) {
  sync::LaserClock::Config laser;
  laser.sensor = id;
  sync.lasers.push_back(laser);
}

void add_profile_scanner(SensorId id, sync::Synchroniser::Config& sync) {
  sync::LaserClock::Config laser;
  laser.sensor = id;
  // A datagram spans 0.05 to 1 ms, by the scanner's rate and its size; a fast one sends 18000 a second.
  laser.latency_min = std::chrono::microseconds(500);
  laser.pending_limit = 65536;
  sync.lasers.push_back(laser);
}

void add_pos(const Section& sensor, SensorId id, sync::Synchroniser::Config& sync) {
  if (sync.pos != kSystemSensor) sensor.refuse("driver", "a rig has one POS; another one is named above");
  sync.pos = id;
  sync.clock.label.trusted = id;
  // A scanner's position packets repeat what this receiver told it: later, and by way of the scanner's own clock.
  sync.label_sources.push_back(id);
  sync.arrival_sources.push_back(id);
}

void add_camera(Section& sensor, SensorId id, nanoseconds exposure, sync::Synchroniser::Config& sync) {
  sync::ExposureMatcher::Config camera;
  camera.camera = id;
  camera.exposure = exposure;
  camera.mark_input = static_cast<int>(sensor.integer("event_input", {0, 4}));
  camera.strobe_delay = microseconds_of(sensor.number("strobe_delay_us", {-1e6, 1e6}, 0.0));
  camera.mark_sigma = microseconds_of(sensor.number("mark_sigma_us", {0.01, 1e4}, us(camera.mark_sigma)));
  camera.has_counter = sensor.boolean("has_counter", camera.has_counter);
  camera.counter_wraps = from_seconds(sensor.number("counter_wraps_s", {0, 1e6}, 0.0));
  if (sensor.has("counter_offset_s")) camera.counter_offset = std::chrono::seconds(sensor.integer("counter_offset_s", {-2e9, 2e9}));
  camera.stamp_event = sensor.choice<sync::ExposureMatcher::StampEvent>("stamp_event",
                                                       {{"exposure_start", sync::ExposureMatcher::StampEvent::ExposureStart},
                                                        {"exposure_mid", sync::ExposureMatcher::StampEvent::ExposureMid},
                                                        {"exposure_end", sync::ExposureMatcher::StampEvent::ExposureEnd}},
                                                       camera.stamp_event);
  camera.stamp_delay = microseconds_of(sensor.number("stamp_delay_us", {-1e6, 1e6}, 0.0));
  camera.latency_min = from_seconds(sensor.number("latency_min_ms", {0, 5000}, ms(camera.latency_min)) * 1e-3);
  camera.latency_max = from_seconds(sensor.number("latency_max_ms", {0.1, 5000}, ms(camera.latency_max)) * 1e-3);
  if (const std::string wrong = camera.validate(); !wrong.empty()) sensor.refuse("latency_max_ms", wrong);
  sync.cameras.push_back(camera);
}

void add_pps(Section& sensor, SensorId id, sync::Synchroniser::Config& sync) {
  if (sync.clock.pps != kSystemSensor) sensor.refuse("driver", "a rig has one PPS; another one is named above");
  sync.clock.pps = id;
  sync.clock.edge_delay = microseconds_of(sensor.number("edge_delay_us", {-1000, 10000}, 0.0));
}

void add_wheel(Section& sensor, SensorId id, sync::Synchroniser::Config& sync) {
  sync::WheelOdometer::Config wheel;
  wheel.sensor = id;
  wheel.stamp_delay = microseconds_of(sensor.number("stamp_delay_us", {-1000, 1e6}, us(wheel.stamp_delay)));
  wheel.stamp_sigma = microseconds_of(sensor.number("stamp_sigma_us", {0.01, 1e6}, us(wheel.stamp_sigma)));
  wheel.age = from_seconds(sensor.number("age_ms", {0, 1000}, ms(wheel.age)) * 1e-3);
  sync.wheels.push_back(wheel);
}

void read_time(Section section, sync::Synchroniser::Config& sync) {
  sync.hold = std::chrono::seconds(section.integer("hold_s", {1, 600}, sync.hold.count()));
  sync.hold_bytes = static_cast<std::size_t>(section.integer("hold_mb", {1, 1'000'000}, static_cast<std::int64_t>(sync.hold_bytes / 1'000'000))) * 1'000'000;
  sync.hold_images = static_cast<std::size_t>(section.integer("hold_images", {1, 1000}, static_cast<std::int64_t>(sync.hold_images)));
  sync.clock.label.agreeing = static_cast<int>(section.integer("agreeing_labels", {1, 1000}, sync.clock.label.agreeing));
  if (section.has("not_before_year")) {
    const int year = static_cast<int>(section.integer("not_before_year", {1980, 2100}));
    sync.clock.label.not_before = *from_utc({year, 1, 7, 0, 0, 0, 0});
  }
  section.finish();
}

}  // namespace hueline::config
