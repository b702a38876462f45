#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/feed.hpp"
#include "runtime/feed_server.hpp"
#include "runtime/feed_state.hpp"
#include "storage/view_messages.hpp"

namespace hueline::runtime {

/// A line of the feed's events.
struct FeedEvent {
  std::optional<GpsTime> time;
  double drive_s = 0;
  const char* kind = "";   ///< "health", "fault", "clock", "mark" or "command"
  const char* level = "";  ///< "info", or the word of a HealthLevel
  std::string sensor, text, action;
};

/// What the pipeline's thread leaves for the feed's thread. All of it is bounded.
struct FeedNews {
  static constexpr std::size_t kMostPoints = 200'000, kMostEvents = 1000;

  std::optional<Geodetic> origin;
  std::vector<ColouredPoint> points;
  std::optional<InsSolution> solution;  ///< the newest
  std::optional<GnssFix> fix;           ///< the newest
  std::map<SensorId, Exposure> images;  ///< the newest of each camera
  std::deque<FeedEvent> events;
  std::uint64_t events_left_out = 0;
  std::optional<DriveState> state;
  std::size_t map_begin = 0;  ///< number of the first second in `map`
  std::vector<DriveMap::Second> map;
};

/// The feed's thread: it makes messages of the news and gives them to the listeners.
class FeedThread {
 public:
  FeedThread(const config::Rig& rig, Feed::Config config);
  ~FeedThread();
  /// Opens the socket and starts the thread.
  Status start(const std::filesystem::path& socket);
  /// Takes the news and leaves a null pointer there, if the thread has taken the last ones. Never waits.
  bool try_give(std::unique_ptr<FeedNews>& news);
  /// Lets the thread take what was given, and ends it.
  void stop();

  /// Says what listeners want; costly news of other kinds need not be left.
  bool wants_cloud() const { return wants_cloud_.load(std::memory_order_relaxed); }
  bool wants_images() const { return wants_images_.load(std::memory_order_relaxed); }

 private:
  void run(const std::stop_token& stop);
  void take(FeedNews news);
  void show(const std::vector<storage::ViewMessage>& messages);
  void show(const FeedEvent& event);
  void take_map(const FeedNews& news);
  void publish_state();
  void publish(std::size_t channel, const nlohmann::ordered_json& json);
  std::vector<std::string> beginning_of(std::size_t channel) const;
  /// Number of the drive's second with which the map begins.
  std::size_t begin_second() const { return static_cast<std::size_t>(config_.begin_s); }

  const config::Rig rig_;
  const Feed::Config config_;
  const std::vector<std::string> names_;
  StatusWriter status_;
  std::unique_ptr<FeedServer> server_;
  std::size_t status_channel_ = 0, events_channel_ = 0, map_channel_ = 0, diagnostics_channel_ = 0;
  std::optional<storage::ViewMessages> view_;  // from the origin on
  std::vector<std::size_t> view_channels_;     // of the server, by the view's channel
  std::optional<Geodetic> origin_;
  std::optional<DriveState> state_;
  std::deque<std::string> last_events_;
  std::vector<DriveMap::Second> map_;
  std::optional<GpsTime> newest_;
  std::atomic<FeedNews*> given_{nullptr};
  std::atomic<bool> wants_cloud_{false}, wants_images_{false};
  std::jthread thread_;
};

}  // namespace hueline::runtime
