#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "core/measurements.hpp"
#include "runtime/drive_map.hpp"
#include "runtime/health.hpp"
#include "runtime/products.hpp"

namespace hueline::runtime {

/// What only a capture knows about itself.
struct LiveState {
  struct Sensor {
    const char* state = "";  ///< "connecting", "running", "silent" or "ended"
    std::uint64_t shed = 0, refused = 0;
  };
  struct Queue {
    const char* name = "";
    std::uint64_t packets = 0;
    double share = 0;  ///< how full it is, 0 ... 1
  };
  std::vector<Sensor> sensors;  ///< in the order of the rig
  std::vector<Queue> queues;
  std::uint64_t recorded_bytes = 0;
  std::uint64_t free_bytes = 0;  ///< of the disk
};

/// The state of a drive at one moment, as the pipeline's thread saw it.
struct DriveState {
  struct Sensor {
    HealthLevel level = HealthLevel::Ok;
    std::uint64_t packets = 0, bytes = 0, lost = 0;
    std::optional<HostTime> last;  ///< the last packet
  };
  struct Clock {
    SyncState state = SyncState::Unlocked;
    double since_s = 0;  ///< time of the drive at which it got this state
  };
  double drive_s = 0, path_m = 0;
  HostTime newest{};  ///< the newest packet of any kind
  std::optional<GpsTime> gps;
  HealthLevel level = HealthLevel::Ok;
  std::vector<Sensor> sensors;          ///< by SensorId; [0] is the system
  std::vector<HealthEpisode> troubles;  ///< those that last
  std::map<SensorId, Clock> clocks;
  std::optional<nanoseconds> host_sigma;  ///< of the computer's clock
  std::optional<InsSolution> solution;
  std::optional<GnssFix> fix;
  std::uint64_t points = 0, coloured = 0, exposures = 0;
  std::vector<OperatorCommand> marks;  ///< the last ones
  std::size_t first_mark = 0;          ///< number of marks before them
};

/// Writes the state of a drive as the JSON of the live feed: the topics /hueline/status and /diagnostics
/// (docs/formats.md). It keeps the last two seconds, for rates.
/// Thread safety: none.
class StatusWriter {
 public:
  StatusWriter(const config::Rig& rig, std::string mode, std::string drive);
  /// `live` is empty in a replay. `now` is this computer's time, `since` the UTC time of the start.
  nlohmann::ordered_json status(const DriveState& state, const std::optional<LiveState>& live, HostTime now);
  /// Returns the diagnostics of the last status().
  static nlohmann::ordered_json diagnostics(const nlohmann::ordered_json& status);
  const std::string& since() const { return since_; }

 private:
  struct Sample {
    double seconds = 0;
    std::vector<std::uint64_t> packets, bytes;
    std::uint64_t recorded_bytes = 0, points = 0;
  };
  nlohmann::ordered_json sensor_json(const config::Sensor& sensor, const DriveState& state,
                                     const std::optional<LiveState>& live, const Sample& now, HostTime host) const;

  const config::Rig rig_;
  const std::vector<std::string> names_;
  const std::string mode_, drive_, since_;
  std::deque<Sample> samples_;
};

/// Returns rows of the drive's map as JSON: the topic /hueline/map. `first` is the number of the first second; only
/// every `step`-th second is written.
nlohmann::ordered_json map_json(const Geodetic& origin, const std::vector<DriveMap::Second>& seconds, std::size_t first,
                                std::size_t step);

}  // namespace hueline::runtime
