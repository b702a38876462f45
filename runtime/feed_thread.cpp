#include "runtime/feed_thread.hpp"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/calendar.hpp"
#include "core/json_text.hpp"
#include "drivers/transport/host_clock.hpp"
#include "runtime/thread_name.hpp"
#include "runtime/view_rig.hpp"

namespace hueline::runtime {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

constexpr int kLook_ms = 20;
constexpr auto kStatusEvery = std::chrono::milliseconds(100);
constexpr auto kDiagnosticsEvery = std::chrono::seconds(1);
constexpr std::size_t kLastEvents = 500;    // that a new listener gets
constexpr std::size_t kMostMapRows = 5000;  // in one message

storage::ViewMessages::Config view_config() {
  storage::ViewMessages::Config config;
  config.keep_every = 1;  // the points are thinned before
  config.cloud_interval = std::chrono::milliseconds(200);
  config.image_longest_px = 1024;
  config.jpeg_quality = 75;
  return config;
}

/// What waits at most for a slow listener.
std::size_t depth_of(const std::string& topic) {
  if (topic == "/cloud") return 8;
  if (topic == "/log" || topic == "/health") return 100;
  return topic == "/tf" ? 4 : 1;
}

/// Reads the note of the command `pace`: a speed, and behind a space the word `paused`.
std::optional<Pace> pace_of(std::string_view note) {
  constexpr double kMostSpeed = 1000;
  Pace out;
  const auto [end, failed] = std::from_chars(note.data(), note.data() + note.size(), out.speed);
  const std::string_view rest = note.substr(static_cast<std::size_t>(end - note.data()));
  out.is_paused = rest == " paused";
  if (failed != std::errc() || !(out.speed >= 0 && out.speed <= kMostSpeed) || !(rest.empty() || out.is_paused))
    return {};
  return out;
}

ordered_json json_of(const ReplayState& replay) {
  return {{"speed", replay.pace.speed},
          {"paused", replay.pace.is_paused},
          {"from_s", replay.from_s},
          {"position_s", replay.position_s},
          {"duration_s", replay.duration_s ? ordered_json(*replay.duration_s) : ordered_json()}};
}

std::int64_t unix_now() {
  return std::chrono::duration_cast<nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

FeedThread::FeedThread(const config::Rig& rig, Feed::Config config)
    : rig_(rig), config_(std::move(config)), names_(rig.sensor_names()), status_(rig, config_.mode, config_.drive) {}

FeedThread::~FeedThread() { stop(); }

Status FeedThread::start(const std::filesystem::path& socket) {
  const ordered_json hello = {{"protocol", feed::kProtocol}, {"mode", config_.mode},     {"rig", rig_.name},
                              {"drive", config_.drive},      {"since", status_.since()}, {"pid", ::getpid()}};
  auto server = FeedServer::create(
      socket, json_text(hello),
      [this](const std::string& word, const std::string& note) -> Status {
        if (word == "segment")
          return Error{ErrorCode::Unsupported, "a recording has no segments yet: stop, and start another drive"};
        for (const auto kind : {DriveCommand::Kind::Mark, DriveCommand::Kind::Stop}) {
          if (word != name(kind)) continue;
          if (Status checked = check_note(note); !checked.ok()) return checked;
          return config_.on_command({kind, note});
        }
        if (word == "pace" && config_.on_pace) {
          const auto pace = pace_of(note);
          if (!pace)
            return Error{ErrorCode::Invalid, "pace needs a speed of 0 to 1000, and after it the word paused if it is"};
          config_.on_pace(*pace);
          return {};
        }
        return Error{ErrorCode::Invalid, config_.on_pace ? "a replay takes the commands stop and pace only"
                                                         : "the feed takes the commands mark and stop only"};
      },
      [this](std::size_t channel) { return beginning_of(channel); });
  if (!server.ok()) return server.error();
  server_ = std::move(*server);
  const auto add = [this](const char* topic, const char* schema, std::size_t depth, bool is_kept) {
    return server_->add({topic, "json", schema, "jsonschema", R"({"type":"object"})", depth, is_kept});
  };
  status_channel_ = add("/hueline/status", "hueline.Status", 1, true);
  events_channel_ = add("/hueline/events", "hueline.Event", kLastEvents + 100, false);
  map_channel_ = add("/hueline/map", "hueline.Map", 60, false);
  diagnostics_channel_ = add("/diagnostics", "hueline.Diagnostics", 1, true);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  return {};
}

bool FeedThread::try_give(std::unique_ptr<FeedNews>& news) {
  FeedNews* nothing = nullptr;
  if (!given_.compare_exchange_strong(nothing, news.get(), std::memory_order_acq_rel)) return false;
  (void)news.release();
  return true;
}

void FeedThread::stop() {
  if (thread_.joinable()) {
    thread_.request_stop();
    thread_.join();
  }
  const std::unique_ptr<FeedNews> rest(given_.exchange(nullptr));
}

void FeedThread::run(const std::stop_token& stop) {
  name_this_thread("feed");
  auto status = Clock::now(), diagnostics = status, cloud = status;
  for (bool is_last = false;; is_last = stop.stop_requested()) {
    if (const std::unique_ptr<FeedNews> news(given_.exchange(nullptr, std::memory_order_acq_rel)); news) {
      if (!news->points.empty()) cloud = Clock::now();
      take(std::move(*news));
    }
    const auto now = Clock::now();
    if (now >= status || is_last) {
      status = now + kStatusEvery;
      publish_state();
    }
    if (now >= diagnostics && state_) {
      diagnostics = now + kDiagnosticsEvery;
      std::optional<LiveState> live;
      if (server_->is_wanted(diagnostics_channel_)) {
        if (config_.live) live = config_.live();
        publish(diagnostics_channel_, StatusWriter::diagnostics(status_.status(*state_, live, drivers::host_now())));
      }
    }
    // What waits to fill a message is shown when nothing follows.
    if (view_ && (is_last || now - cloud > std::chrono::milliseconds(500))) {
      cloud = now;
      show(view_->make_rest_of_cloud());
    }
    const auto wanted = [this](std::string_view begin) {
      if (!view_) return true;
      for (std::size_t i = 0; i < view_channels_.size(); ++i)
        if (view_->channels()[i].topic.starts_with(begin) && server_->is_wanted(view_channels_[i])) return true;
      return false;
    };
    wants_cloud_ = view_ && wanted("/cloud");
    wants_images_ = view_ && (wanted("/image/") || wanted("/camera/"));
    server_->wait(kLook_ms);
    if (is_last) return;
  }
}

void FeedThread::take(FeedNews news) {
  if (news.origin) {
    origin_ = news.origin;
    view_.emplace(*origin_, view_rig(rig_), view_config());
    view_channels_.clear();
    show(std::vector<storage::ViewMessage>{});  // adds the channels
  }
  if (news.state) state_ = std::move(news.state);
  if (news.solution) newest_ = news.solution->time;
  if (view_) {
    if (news.solution) show(view_->make(*news.solution));
    if (news.fix) show(view_->make(*news.fix));
    if (!news.points.empty()) {
      CloudBlock block;
      block.origin = *origin_;
      block.points = std::move(news.points);
      show(view_->make(block));
    }
    for (const auto& [camera, exposure] : news.images)
      if (const auto made = view_->make(exposure, names_.at(camera)); made.ok()) show(*made);
  }
  if (news.events_left_out > 0)
    show(FeedEvent{newest_,
                   state_ ? state_->drive_s : 0,
                   "fault",
                   "info",
                   "drive",
                   std::to_string(news.events_left_out) + " events are left out of the live feed",
                   {}});
  for (const FeedEvent& event : news.events) show(event);
  take_map(news);
}

/// Gives messages of the view to the listeners, and adds their channels if they are new.
void FeedThread::show(const std::vector<storage::ViewMessage>& messages) {
  const auto& channels = view_->channels();
  for (std::size_t i = view_channels_.size(); i < channels.size(); ++i) {
    const std::string& topic = channels[i].topic;
    const bool is_kept = topic != "/cloud" && topic != "/log" && topic != "/health" && !topic.starts_with("/image/");
    view_channels_.push_back(server_->add(
        {topic, "protobuf", channels[i].schema_name, "protobuf", channels[i].schema, depth_of(topic), is_kept}));
  }
  for (const auto& one : messages)
    server_->publish(view_channels_[one.channel], count_ns(to_unix(one.time)), one.bytes);
}

void FeedThread::show(const FeedEvent& event) {
  const std::optional<GpsTime> time = event.time ? event.time : newest_;
  ordered_json json = {{"time", nullptr},       {"drive_s", event.drive_s}, {"kind", event.kind},
                       {"level", event.level},  {"sensor", event.sensor},   {"text", event.text},
                       {"action", event.action}};
  if (time) json["time"] = iso_utc(*time);
  last_events_.push_back(feed::message_frame(static_cast<std::uint32_t>(events_channel_), unix_now(), json_text(json)));
  if (last_events_.size() > kLastEvents) last_events_.pop_front();
  publish(events_channel_, json);
  if (!view_ || !time) return;
  using Level = storage::ViewMessages::Level;
  const std::string_view level = event.level, kind = event.kind;
  const Level shown = level == "alarm"     ? Level::Error
                      : level == "warning" ? Level::Warning
                      : kind == "fault"    ? Level::Warning
                                           : Level::Info;
  const std::string line = event.action.empty() ? event.text : event.text + "; " + event.action;
  show(kind == "health" ? view_->make_health(*time, shown, event.sensor, line)
                        : view_->make_log(*time, shown, event.sensor, line));
}

void FeedThread::take_map(const FeedNews& news) {
  if (news.map.empty()) return;
  map_.resize(news.map_begin);
  map_.insert(map_.end(), news.map.begin(), news.map.end());
  if (!origin_ || !server_->is_wanted(map_channel_)) return;
  const std::size_t first = map_.size() - std::min(map_.size(), std::min(news.map.size(), kMostMapRows));
  publish(map_channel_, map_json(*origin_, {map_.begin() + static_cast<std::ptrdiff_t>(first), map_.end()},
                                 begin_second() + first, 1));
}

void FeedThread::publish_state() {
  if (!state_ || !server_->is_wanted(status_channel_)) return;
  std::optional<LiveState> live;
  if (config_.live) live = config_.live();
  auto json = status_.status(*state_, live, drivers::host_now());
  if (config_.replay) json["replay"] = json_of(config_.replay());
  json["listeners_lost"] = server_->lost();
  publish(status_channel_, json);
}

void FeedThread::publish(std::size_t channel, const ordered_json& json) {
  server_->publish(channel, unix_now(), json_text(json));
}

std::vector<std::string> FeedThread::beginning_of(std::size_t channel) const {
  if (channel == events_channel_) return {last_events_.begin(), last_events_.end()};
  if (channel == map_channel_ && origin_ && !map_.empty()) {
    const std::size_t step = (map_.size() + kMostMapRows - 1) / kMostMapRows;
    return {feed::message_frame(static_cast<std::uint32_t>(channel), unix_now(),
                                json_text(map_json(*origin_, map_, begin_second(), step)))};
  }
  return {};
}

}  // namespace hueline::runtime
