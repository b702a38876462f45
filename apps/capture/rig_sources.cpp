#include "apps/capture/rig_sources.hpp"

#include <chrono>
#include <memory>
#include <span>
#include <utility>

#include "drivers/device.hpp"
#include "runtime/file_merge.hpp"

namespace hueline::apps {

std::vector<runtime::LiveRun::Source> sources_of(const config::Rig& rig, const BufferPool& pool) {
  std::vector<runtime::LiveRun::Source> sources;
  for (const auto& sensor : rig.sensors) {
    runtime::Reader::Config reader;
    reader.silent_after = std::chrono::milliseconds(static_cast<std::int64_t>(sensor.silent_after_s * 1000));
    reader.is_recording = sensor.device->arrivals() != drivers::Arrivals::Live;
    if (const auto* camera = dynamic_cast<const drivers::CameraDevice*>(sensor.device.get());
        camera && rig.recording.pack_images)
      reader.pixel_rows = [camera](std::span<const std::byte> packet) { return camera->pixel_rows(packet); };
    sources.push_back({sensor.id, sensor.name, sensor.device->make_source(pool), reader, sensor.type->is_sheddable});
  }
  if (!rig.sync.self_timed) return sources;
  std::vector<runtime::FileMerge::Input> files;
  for (std::size_t i = 0; i < sources.size(); ++i)
    files.push_back({std::move(sources[i].source), rig.sensors[i].device->make_decoder(),
                     rig.sensors[i].device->arrivals() == drivers::Arrivals::Recorded});
  const auto merge = std::make_shared<runtime::FileMerge>(
      std::move(files), runtime::FileMerge::Config{.agreeing_labels = rig.sync.clock.label.agreeing});
  auto merged = runtime::FileMerge::sources(merge);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    sources[i].source = std::move(merged[i]);
    sources[i].now = [merge] { return merge->position(); };
  }
  return sources;
}

}  // namespace hueline::apps
