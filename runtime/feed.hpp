#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "core/packet.hpp"
#include "runtime/feed_state.hpp"
#include "runtime/outputs.hpp"
#include "runtime/pacer.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/products.hpp"

namespace hueline::runtime {

/// How a replay runs, and where it is.
struct ReplayState {
  Pace pace;
  double from_s = 0;      ///< s of the drive from which it is shown
  double position_s = 0;  ///< s of the drive that it has reached
  std::optional<double> duration_s;
};

class FeedThread;
struct FeedNews;
struct FeedEvent;

/// Publishes a running capture or replay on a local socket (core/feed_protocol.hpp, docs/formats.md): the messages of
/// storage::ViewMessages, and the state of the drive as JSON. It stands between the pipeline and Outputs.
///
/// A thread of its own makes and sends the messages. The pipeline's thread only leaves there what is new. It never
/// waits for the feed's thread, and what it leaves is bounded: a point, pose or image that finds no room is missing in
/// the feed. The recording and the products do not depend on the feed.
/// Thread safety: one thread, the pipeline's, calls all functions.
class Feed : public ProductSink {
 public:
  struct Config {
    std::string mode;                 ///< "capture" or "replay"
    std::string drive;                ///< name of the drive
    std::function<LiveState()> live;  ///< called on the feed's thread ten times a second; empty in a replay
    /// Takes a command of a listener, on the feed's thread. An error is told to the listener.
    std::function<Status(const DriveCommand&)> on_command;
    double points_per_s = 60'000;  ///< the cloud is thinned to about so many points
    /// Of a replay: how it runs. Called on the feed's thread ten times a second.
    std::function<ReplayState()> replay = {};
    /// Of a replay: takes the pace that a listener asks for, on the feed's thread.
    std::function<void(const Pace&)> on_pace = {};
    double begin_s = 0;  ///< s of the drive before the part that is replayed; times in the feed are those of the drive
  };

  /// `outputs` gets all products first. It must outlive the feed. Errors: those of listen_locally().
  static Result<std::unique_ptr<Feed>> create(const std::filesystem::path& socket, const config::Rig& rig,
                                              Outputs& outputs, const Config& config);
  ~Feed() override;

  /// To be called after each packet that the pipeline has processed.
  void note(const Packet& packet, const Pipeline& pipeline);
  /// Sends the last state, ends the feed and its thread. `live` and `on_command` are not called any more. To be called
  /// on the thread that would call note().
  void finish(const Pipeline& pipeline);

  void on_origin(const Geodetic& origin) override;
  void on_cloud(const CloudBlock& block, const fusion::Trajectory& trajectory) override;
  void on_exposure(const Exposure& exposure) override;
  void on_solution(const InsSolution& solution) override;
  void on_fix(const GnssFix& fix) override;
  void on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) override;
  void on_fault(const Fault& fault) override;
  void on_health(const HealthChange& change) override;
  void on_command(const OperatorCommand& command) override;

 private:
  Feed(const config::Rig& rig, Outputs& outputs, const Config& config, std::unique_ptr<FeedThread> thread);
  void tell(FeedEvent event);
  void observe(const Pipeline& pipeline);
  bool hand_over();
  const std::string& name_of(SensorId sensor) const;

  Outputs& outputs_;
  const std::vector<std::string> names_;  // by SensorId
  const double points_per_s_, begin_s_;
  std::unique_ptr<FeedNews> news_;  // what the feed's thread has not got yet
  std::unique_ptr<FeedThread> thread_;
  std::chrono::steady_clock::time_point observed_{}, handed_over_{}, mapped_{};
  DriveState state_;
  std::map<SensorId, GpsTime> images_;  // when the last image of a camera was left for the thread
  std::size_t map_known_ = 0;           // seconds of the map that the thread has
  // The thinning follows the rate of the points.
  std::uint64_t points_seen_ = 0, keep_every_ = 1, points_in_span_ = 0;
  std::optional<GpsTime> span_begin_;
};

}  // namespace hueline::runtime
