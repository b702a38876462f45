#include "runtime/feed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "runtime/feed_thread.hpp"

namespace hueline::runtime {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kObserveEvery = std::chrono::milliseconds(100);
constexpr auto kGiveEvery = std::chrono::milliseconds(20);
constexpr auto kMapEvery = std::chrono::seconds(1);
constexpr nanoseconds kImageEvery = std::chrono::seconds(1);
constexpr std::size_t kMostMarks = 100;
/// The cloud comes up to this long after the vehicle has passed, so that many seconds of the map still change.
constexpr std::size_t kChangingSeconds = 30;

}  // namespace

Feed::Feed(const config::Rig& rig, Outputs& outputs, const Config& config, std::unique_ptr<FeedThread> thread)
    : outputs_(outputs),
      names_(rig.sensor_names()),
      points_per_s_(config.points_per_s),
      begin_s_(config.begin_s),
      news_(std::make_unique<FeedNews>()),
      thread_(std::move(thread)) {
  state_.sensors.resize(names_.size());
}

Feed::~Feed() = default;

Result<std::unique_ptr<Feed>> Feed::create(const std::filesystem::path& socket, const config::Rig& rig,
                                           Outputs& outputs, const Config& config) {
  auto thread = std::make_unique<FeedThread>(rig, config);
  if (Status started = thread->start(socket); !started.ok()) return started.error();
  return std::unique_ptr<Feed>(new Feed(rig, outputs, config, std::move(thread)));
}

const std::string& Feed::name_of(SensorId sensor) const {
  static const std::string kDrive = "drive";
  return sensor == kSystemSensor || sensor >= names_.size() ? kDrive : names_[sensor];
}

void Feed::note(const Packet& packet, const Pipeline& pipeline) {
  state_.newest = std::max(state_.newest, packet.received);
  if (packet.kind == PacketKind::Wire && packet.sensor < state_.sensors.size()) {
    DriveState::Sensor& sensor = state_.sensors[packet.sensor];
    ++sensor.packets;
    sensor.bytes += packet.bytes.size();
    sensor.last = sensor.last ? std::max(*sensor.last, packet.received) : packet.received;
  }
  const auto now = Clock::now();
  if (now - observed_ >= kObserveEvery) {
    observed_ = now;
    observe(pipeline);
  }
  if (now - handed_over_ >= kGiveEvery) {
    handed_over_ = now;
    hand_over();
  }
}

void Feed::finish(const Pipeline& pipeline) {
  mapped_ = {};
  observe(pipeline);
  // The thread takes the news within one look; the drive is over, so this waits.
  for (int i = 0; i < 100 && !hand_over(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  thread_->stop();
}

/// Leaves the state of the drive for the thread.
void Feed::observe(const Pipeline& pipeline) {
  const Health& health = pipeline.health();
  const Summary& summary = outputs_.summary();
  state_.drive_s = begin_s_ + health.drive_s();
  state_.path_m = health.path_m();
  state_.gps = pipeline.synchroniser().stream_time();
  state_.level = health.level(kSystemSensor);
  for (std::size_t id = 1; id < state_.sensors.size(); ++id)
    state_.sensors[id].level = health.level(static_cast<SensorId>(id));
  state_.troubles.clear();
  for (const HealthEpisode& one : health.episodes())
    if (one.lasts) {
      state_.troubles.push_back(one);
      state_.troubles.back().begin_s += begin_s_;
    }
  state_.host_sigma.reset();
  if (const auto stamp = pipeline.synchroniser().clock().stamp(state_.newest)) state_.host_sigma = stamp->sigma;
  state_.points = summary.points();
  state_.coloured = summary.coloured_points();
  state_.exposures = summary.exposures();
  const auto& marks = summary.marks();
  state_.first_mark = marks.size() > kMostMarks ? marks.size() - kMostMarks : 0;
  if (marks.size() != state_.first_mark + state_.marks.size()) {
    state_.marks.assign(marks.begin() + static_cast<std::ptrdiff_t>(state_.first_mark), marks.end());
    for (OperatorCommand& mark : state_.marks) mark.drive_s += begin_s_;
  }
  news_->state = state_;

  const auto now = Clock::now();
  if (now - mapped_ < kMapEvery) return;
  mapped_ = now;
  const auto& seconds = outputs_.map().seconds();
  news_->map_begin = map_known_ > kChangingSeconds ? map_known_ - kChangingSeconds : 0;
  news_->map.assign(seconds.begin() + static_cast<std::ptrdiff_t>(std::min(news_->map_begin, seconds.size())),
                    seconds.end());
}

bool Feed::hand_over() {
  const std::size_t known = news_->map.empty() ? map_known_ : news_->map_begin + news_->map.size();
  if (!thread_->try_give(news_)) return false;
  map_known_ = known;
  news_ = std::make_unique<FeedNews>();
  return true;
}

void Feed::tell(FeedEvent event) {
  if (news_->events.size() >= FeedNews::kMostEvents) {
    news_->events.pop_front();
    ++news_->events_left_out;
  }
  news_->events.push_back(std::move(event));
}

void Feed::on_origin(const Geodetic& origin) {
  outputs_.on_origin(origin);
  news_->origin = origin;
}

void Feed::on_cloud(const CloudBlock& block, const fusion::Trajectory& trajectory) {
  outputs_.on_cloud(block, trajectory);
  if (block.points.empty()) return;
  const GpsTime time = block.points.back().time;
  points_in_span_ += block.points.size();
  if (!span_begin_ || time < *span_begin_) span_begin_ = time, points_in_span_ = 0;
  if (const double span_s = to_seconds(time - *span_begin_); span_s >= 1) {
    const double rate = static_cast<double>(points_in_span_) / span_s;
    keep_every_ = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(rate / points_per_s_ + 0.5));
    span_begin_ = time, points_in_span_ = 0;
  }
  if (!thread_->wants_cloud()) return;
  for (const ColouredPoint& point : block.points) {
    if (points_seen_++ % keep_every_ != 0) continue;
    if (news_->points.size() >= FeedNews::kMostPoints) return;
    news_->points.push_back(point);
  }
}

void Feed::on_exposure(const Exposure& exposure) {
  outputs_.on_exposure(exposure);
  if (!thread_->wants_images() || !exposure.image.is_complete) return;
  const auto last = images_.find(exposure.camera);
  const GpsTime time = exposure.exposure_mid;
  if (last != images_.end() && time >= last->second && time - last->second < kImageEvery) return;
  images_[exposure.camera] = time;
  news_->images[exposure.camera] = exposure;
}

void Feed::on_solution(const InsSolution& solution) {
  outputs_.on_solution(solution);
  state_.solution = news_->solution = solution;
}

void Feed::on_fix(const GnssFix& fix) {
  outputs_.on_fix(fix);
  state_.fix = news_->fix = fix;
}

void Feed::on_sync_state(std::optional<GpsTime> time, SensorId clock, SyncState state) {
  outputs_.on_sync_state(time, clock, state);
  state_.clocks[clock] = {state, state_.drive_s};
  tell({time, state_.drive_s, "clock", "info", name_of(clock), name(state), {}});
}

void Feed::on_fault(const Fault& fault) {
  outputs_.on_fault(fault);
  if ((fault.kind == FaultKind::Lost || fault.kind == FaultKind::Overflow) && fault.sensor < state_.sensors.size())
    state_.sensors[fault.sensor].lost += fault.count;
  tell({{},
        state_.drive_s,
        "fault",
        "info",
        name_of(fault.sensor),
        fmt::format("{} x{}: {}", name(fault.kind), fault.count, fault.detail),
        {}});
}

void Feed::on_health(const HealthChange& change) {
  outputs_.on_health(change);
  const bool is_trouble = change.trouble && change.level != HealthLevel::Ok;
  tell({change.time, begin_s_ + change.drive_s, "health", change.trouble ? name(change.level) : "info",
        name_of(change.sensor), is_trouble ? change.cause : text(change), change.action});
}

void Feed::on_command(const OperatorCommand& command) {
  outputs_.on_command(command);
  const bool is_mark = command.command.kind == DriveCommand::Kind::Mark;
  tell({command.time,
        begin_s_ + command.drive_s,
        is_mark ? "mark" : "command",
        "info",
        "operator",
        is_mark ? command.command.note : text(command),
        {}});
}

}  // namespace hueline::runtime
