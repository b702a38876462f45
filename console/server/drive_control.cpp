#include "console/server/drive_control.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <ctime>
#include <map>
#include <utility>

#include "console/server/json_fields.hpp"
#include "console/server/users.hpp"
#include "core/drive_command.hpp"
#include "core/json_text.hpp"

namespace hueline::console {
namespace {

using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

constexpr const char* kStatusTopic = "/hueline/status";
constexpr double kMostSpeed = 1000, kLongestDrive_s = 1e6;
constexpr auto kLookEvery = std::chrono::milliseconds(100);
constexpr auto kOldAfter = std::chrono::seconds(2);  // as the page has it
constexpr auto kSearchEvery = std::chrono::milliseconds(500);

std::string utc(const char* format) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[64];
  return {text, std::strftime(text, sizeof text, format, &parts)};
}

/// Whether a capture that ends so has failed while it drove: by an unexpected error, by its disk, or by a signal
/// (apps/exit_code.hpp).
bool is_failure(int exit_status) { return exit_status == 1 || exit_status == 4 || exit_status >= 128; }

}  // namespace

DriveControl::DriveControl(boost::asio::io_context& io, Places places)
    : io_(io),
      places_(std::move(places)),
      programs_(places_),
      timer_(io),
      check_({{"state", "none"},
              {"rig", nullptr},
              {"at", nullptr},
              {"ready", nullptr},
              {"items", ordered_json::array()},
              {"error", ""},
              {"exit_status", nullptr}}) {}

void DriveControl::start() {
  find_feed();
  look();
}

void DriveControl::look() {
  watch_programs();
  // The first status comes with the first packet; that a sensor begins late is for health to say.
  const bool is_silent = step_ == Step::Running && !is_replay_ && status_at_ && Clock::now() - *status_at_ > kOldAfter;
  if (is_silent != alarms_.has(Alarms::kSilent)) alarms_.set(Alarms::kSilent, is_silent);
  if (next_ && !capture_.is_running() && !feed_) run_next_replay();
  if (!feed_ && Clock::now() - looked_ >= kSearchEvery) find_feed();
  changed();
  timer_.expires_after(kLookEvery);
  timer_.async_wait([this](boost::system::error_code failed) {
    if (!failed) look();
  });
}

void DriveControl::acknowledge(const std::string& alarm) {
  alarms_.acknowledge(alarm);
  changed();
}

void DriveControl::set_sound_trouble(const std::string& why) {
  sound_trouble_ = why;
  changed();
}

/// Tells a change of the state.
void DriveControl::changed() {
  std::string now = json_text(state_json());
  if (now == told_) return;
  told_ = std::move(now);
  if (on_change) on_change();
}

void DriveControl::find_feed() {
  looked_ = Clock::now();
  std::error_code failed;
  // The one that this console has started comes first: a folder may hold more than is looked at.
  if (step_ != Step::Idle && !drive_.empty()) {
    const fs::path folder = is_replay_ ? programs_.replays() : places_.drives;
    const fs::path socket = folder / drive_ / feed::kSocketName;
    if (fs::is_socket(socket, failed) && try_feed(socket)) return;
  }
  for (const fs::path& folder : {places_.drives, programs_.replays()}) {
    std::size_t seen = 0;
    for (fs::directory_iterator at(folder, failed), end; !failed && at != end && seen < Places::kMostDrives;
         at.increment(failed), ++seen) {
      std::error_code ignored;
      const fs::path socket = at->path() / feed::kSocketName;
      if (fs::is_socket(socket, ignored) && try_feed(socket)) return;
    }
    failed.clear();
  }
}

bool DriveControl::try_feed(const fs::path& socket) {
  auto link = FeedLink::connect(io_, socket);
  if (!link.ok()) return false;  // left there by a program that was killed
  feed_ = *link;
  feed_path_ = socket;
  const auto next = [this, weak = std::weak_ptr(feed_)](const auto& again) -> void {
    const auto link_now = weak.lock();
    if (!link_now) return;
    link_now->read(
        [this, again](const feed::FrameReader::Frame& frame) {
          const ordered_json json =
              frame.kind == feed::Kind::Message ? ordered_json() : ordered_json::parse(frame.content, nullptr, false);
          if (frame.kind == feed::Kind::Hello && json.is_object()) {
            is_replay_ = json.value("mode", "") == "replay";
            drive_ = json.value("drive", "");
            rig_ = json.value("rig", "");
            since_ = json.value("since", "");
            alarms_.set(Alarms::kEnded, false);
            if (step_ != Step::Stopping) step_ = Step::Running;
            if (is_replay_ && replay_.is_paused) (void)pace(true, {}, [](const std::string&) {});
            if (const std::string note = std::exchange(first_note_, {}); !note.empty() && !is_replay_)
              (void)mark(note, [](const std::string&) {});
            changed();
          }
          if (frame.kind == feed::Kind::Channel && json.is_object() && json.value("topic", "") == kStatusTopic) {
            status_channel_ = json.value("id", std::uint32_t{0});
            feed_->send(feed::Kind::Subscribe, ordered_json{{"channels", {*status_channel_}}}.dump());
          }
          if (frame.kind == feed::Kind::Message)
            if (const auto message = feed::read_message(frame.content); message && message->channel == status_channel_)
              take_status(std::string(message->bytes));
          if (frame.kind == feed::Kind::Answer && json.is_object())
            if (const auto found = commands_.find(json.value("id", std::uint64_t{0})); found != commands_.end()) {
              const auto done = std::move(found->second);
              commands_.erase(found);
              done(json.value("error", ""));
            }
          again(again);
        },
        [this] {
          feed_.reset();
          status_channel_.reset();
          status_at_.reset();
          alarms_.end_drive();
          // Its feed takes the socket along when it ends by itself.
          std::error_code ignored;
          if (!is_replay_ && step_ == Step::Running && fs::exists(feed_path_, ignored))
            alarms_.set(Alarms::kEnded, true);
          for (auto& [id, done] : std::exchange(commands_, {})) done("the drive has ended");
          if (!capture_.is_running() && !next_) step_ = Step::Idle;
          changed();
        });
  };
  next(next);
  return true;
}

/// Takes the state of the drive, which comes ten times a second.
void DriveControl::take_status(const std::string& text) {
  const ordered_json status = ordered_json::parse(text, nullptr, false);
  status_at_ = Clock::now();
  if (!is_replay_) alarms_.take(status);
  if (const ordered_json replay = value_at(status, {"replay"}); is_replay_ && !next_ && replay.is_object()) {
    replay_.speed = number_in(replay, "speed", replay_.speed);
    replay_.from_s = number_in(replay, "from_s", replay_.from_s);
    if (const double duration_s = number_in(replay, "duration_s", 0); duration_s > 0) replay_.duration_s = duration_s;
    // A replay that begins paused has not heard of it yet.
    if (commands_.empty()) replay_.is_paused = replay.value("paused", false);
  }
  changed();
}

/// Takes the end of a program: it becomes `last` of the state.
void DriveControl::take_end(const char* what, Child& child) {
  const auto status = child.take_end();
  if (!status || next_) return;
  if (!is_replay_ && step_ != Step::Stopping && is_failure(*status)) alarms_.set(Alarms::kEnded, true);
  last_ = {{"drive", drive_}, {"what", what}, {"exit_status", *status}, {"text", programs_.drive_said()}};
  step_ = Step::Idle;
  player_.ask_to_end();
}

void DriveControl::watch_programs() {
  if (checker_.is_running())
    if (const auto status = checker_.take_end()) {
      const ordered_json found = programs_.checked();
      check_["state"] = "failed";
      if (found.is_object() && found.contains("items")) {
        check_["state"] = "done";
        check_["ready"] = found.value("ready", false);
        for (const char* part : {"items", "lenses", "checklist"})
          check_[part] = found.value(part, ordered_json::array());
      } else {
        check_["exit_status"] = *status;
        check_["error"] = fmt::format("the check ended with status {}: {}", *status, programs_.check_said());
      }
    }
  if (renderer_.is_running())
    if (const auto status = renderer_.take_end()) {
      if (*status != 0 || step_ == Step::Stopping) {
        last_ = {{"drive", drive_}, {"what", "simulate"}, {"exit_status", *status}, {"text", programs_.render_said()}};
        step_ = Step::Idle;
      } else {
        auto player = programs_.emulate(scenario_);
        if (player.ok()) player_ = *player;
        const Status run = player.ok() ? run_capture(programs_.rig_of(scenario_)) : Status(player.error());
        if (!run.ok()) {
          last_ = {{"drive", drive_}, {"what", "capture"}, {"exit_status", 1}, {"text", run.error().message}};
          step_ = Step::Idle;
        }
      }
    }
  if (capture_.is_running()) take_end(is_replay_ ? "replay" : "capture", capture_);
  if (player_.is_running()) (void)player_.take_end();
}

const char* DriveControl::state_word() const {
  switch (step_) {
    case Step::Idle:
      break;
    case Step::Rendering:
    case Step::Starting:
      return "starting";
    case Step::Running:
      return !is_replay_ ? "driving" : replay_.is_paused ? "paused" : "replaying";
    case Step::Stopping:
      return "stopping";
  }
  return checker_.is_running() ? "checking" : "idle";
}

ordered_json DriveControl::state_json() const {
  const bool is_there = step_ != Step::Idle;
  const auto known = [&](const std::string& text) {
    return is_there && !text.empty() ? ordered_json(text) : ordered_json();
  };
  return {{"state", state_word()},
          {"drive", known(drive_)},
          {"rig", known(rig_)},
          {"since", known(since_)},
          {"replay",
           is_there && is_replay_
               ? ordered_json{{"speed", replay_.speed},
                              {"paused", replay_.is_paused},
                              {"from_s", next_ ? next_->from_s : replay_.from_s},
                              {"duration_s", replay_.duration_s ? ordered_json(*replay_.duration_s) : ordered_json()}}
               : ordered_json()},
          {"allow_simulate", !places_.scenarios.empty()},
          {"scenarios", places_.scenario_names()},
          {"last", last_},
          {"ended", alarms_.has(Alarms::kEnded)},
          {"acknowledged", alarms_.acknowledged_json()},
          {"sound_trouble", sound_trouble_}};
}

ordered_json DriveControl::check_json() const {
  ordered_json out = check_;
  if (checker_.is_running()) out["state"] = "running";
  return out;
}

bool DriveControl::is_busy() const {
  return step_ != Step::Idle || feed_ || capture_.is_running() || renderer_.is_running() || checker_.is_running();
}

Status DriveControl::check(const std::string& rig, double seconds) {
  if (is_busy())
    return Error{ErrorCode::Unavailable, fmt::format("the console is {}: wait, or stop the drive", state_word())};
  const auto path = places_.rig_path(rig);
  if (!path.ok()) return path.error();
  auto checker = programs_.check(*path, std::clamp(seconds, 3.0, 60.0));
  if (!checker.ok()) return checker.error();
  checker_ = *checker;
  check_ = {{"state", "running"},
            {"rig", rig},
            {"at", utc("%Y-%m-%dT%H:%M:%SZ")},
            {"ready", nullptr},
            {"items", ordered_json::array()},
            {"lenses", ordered_json::array()},
            {"checklist", ordered_json::array()},
            {"error", ""},
            {"exit_status", nullptr}};
  changed();
  return {};
}

Status DriveControl::run_capture(const std::string& rig) {
  auto capture = programs_.capture(rig, drive_, !scenario_.empty());
  if (!capture.ok()) return capture.error();
  capture_ = *capture;
  step_ = Step::Starting;
  return {};
}

Result<std::string> DriveControl::drive(const std::string& rig, const std::string& name, const std::string& scenario,
                                        const std::string& override_reason, std::size_t checked) {
  if (is_busy())
    return Error{ErrorCode::Unavailable, fmt::format("the console is {}: wait, or stop the drive", state_word())};
  if (!name.empty() && !is_plain_name(name))
    return Error{ErrorCode::Invalid,
                 "the name of a drive has 1 to 64 letters, digits, '.', '_' or '-' and begins with "
                 "a letter or digit"};
  const std::string drive = name.empty() ? utc("%Y-%m-%d_%H%M%S") : name;
  std::error_code ignored;
  if (fs::exists(places_.drives / drive, ignored))
    return Error{ErrorCode::Unavailable, "a drive of this name is there already: choose another name"};
  const std::size_t items = check_.value("rig", ordered_json()) == rig && scenario.empty()
                                ? check_.value("checklist", ordered_json::array()).size()
                                : 0;
  if (checked < items && override_reason.empty())
    return Error{
        ErrorCode::Invalid,
        fmt::format("{} of {} points of the rig's checklist are done: do the others, or say why not", checked, items)};
  std::string note;
  if (!override_reason.empty()) note = "started although the check said not ready: " + override_reason;
  if (items > 0)
    note += fmt::format("{}checklist: {} of {} points done", note.empty() ? "" : "; ", std::min(checked, items), items);
  if (Status fits = check_note(note); !fits.ok()) return fits.error();
  is_replay_ = false;
  scenario_ = scenario;
  drive_ = drive;
  rig_ = rig;
  since_ = utc("%Y-%m-%dT%H:%M:%SZ");
  if (!scenario.empty()) {
    const auto names = places_.scenario_names();
    if (std::ranges::find(names, scenario) == names.end())
      return Error{ErrorCode::Invalid, "there is no such scenario: the console was started without it"};
    auto renderer = programs_.render(scenario);
    if (!renderer.ok()) return renderer.error();
    renderer_ = *renderer;
    step_ = Step::Rendering;
  } else {
    const auto path = places_.rig_path(rig);
    if (!path.ok()) return path.error();
    if (Status run = run_capture(*path); !run.ok()) return run.error();
  }
  first_note_ = note;
  last_ = nullptr;
  changed();
  return drive;
}

Result<std::string> DriveControl::replay(const std::string& drive, double speed, double from_s) {
  if (is_busy())
    return Error{ErrorCode::Unavailable, fmt::format("the console is {}: wait, or stop the drive", state_word())};
  drive_ = drive;
  const Replay wanted{std::clamp(speed, 0.0, kMostSpeed), std::clamp(from_s, 0.0, kLongestDrive_s), false, {}};
  if (Status run = run_replay(wanted); !run.ok()) return run.error();
  last_ = nullptr;
  changed();
  return drive;
}

/// Starts the replay of drive_.
Status DriveControl::run_replay(const Replay& wanted) {
  const auto recording = places_.file_of(drive_, "drive.mcap");
  if (!recording.ok()) return recording.error();
  auto replay = programs_.replay(*recording, drive_, wanted.speed, wanted.from_s);
  if (!replay.ok()) return replay.error();
  capture_ = *replay;
  replay_ = wanted;
  is_replay_ = true;
  scenario_.clear();
  since_ = utc("%Y-%m-%dT%H:%M:%SZ");
  step_ = Step::Starting;
  return {};
}

void DriveControl::run_next_replay() {
  const Replay wanted = *std::exchange(next_, {});
  if (Status run = run_replay(wanted); !run.ok()) {
    last_ = {{"drive", drive_}, {"what", "replay"}, {"exit_status", 1}, {"text", run.error().message}};
    step_ = Step::Idle;
  }
}

Status DriveControl::pace(std::optional<bool> is_paused, std::optional<double> speed,
                          std::function<void(const std::string& error)> done) {
  if (!is_replay_ || step_ == Step::Idle || step_ == Step::Stopping)
    return Error{ErrorCode::Unavailable, "no replay runs that could be paused or be given another speed"};
  Replay wanted = next_ ? *next_ : replay_;
  if (is_paused) wanted.is_paused = *is_paused;
  if (speed) wanted.speed = std::clamp(*speed, 0.0, kMostSpeed);
  if (next_) next_ = wanted;
  replay_.is_paused = wanted.is_paused;
  replay_.speed = wanted.speed;
  // A replay that is about to begin is told when its feed is there.
  if (next_ || !feed_) {
    if (!next_ && speed)
      return Error{ErrorCode::Unavailable, "the replay is starting: give it another speed when it runs"};
    changed();
    done({});
    return {};
  }
  send_command(
      {{"command", "pace"}, {"note", fmt::format("{:.3f}{}", wanted.speed, wanted.is_paused ? " paused" : "")}},
      std::move(done));
  changed();
  return {};
}

Status DriveControl::seek(double position_s) {
  if (!is_replay_ || step_ == Step::Idle || step_ == Step::Stopping)
    return Error{ErrorCode::Unavailable, "no replay runs that could go on from another second: start one"};
  if (!(position_s >= 0 && position_s <= kLongestDrive_s))
    return Error{ErrorCode::Invalid, "position_s must be a second of the drive, 0 or more"};
  const bool is_underway = next_.has_value();
  if (!is_underway) next_ = replay_;
  next_->from_s = position_s;
  if (replay_.duration_s) next_->from_s = std::min(position_s, std::max(0.0, *replay_.duration_s - 1));
  step_ = Step::Starting;
  if (!is_underway) {
    if (capture_.is_running())
      capture_.ask_to_end();
    else if (feed_)
      send_command({{"command", "stop"}}, [](const std::string&) {});
  }
  changed();
  return {};
}

/// Sends a command to the running drive; `done` gets its answer.
void DriveControl::send_command(ordered_json command, std::function<void(const std::string& error)> done) {
  command["id"] = next_command_;
  commands_[next_command_++] = std::move(done);
  feed_->send(feed::Kind::Command, command.dump());
}

Status DriveControl::stop(std::function<void(const std::string& error)> done) {
  if (step_ == Step::Idle) return Error{ErrorCode::Unavailable, "nothing runs that could be stopped"};
  const Step before = std::exchange(step_, Step::Stopping);
  if (std::exchange(next_, {})) {  // the replay that was to begin does not; the one before is ending already
    if (!feed_ && !capture_.is_running()) step_ = Step::Idle;
    changed();
    done({});
    return {};
  }
  if (before == Step::Stopping || !feed_) {
    if (before != Step::Stopping) capture_.ask_to_end();
    renderer_.ask_to_end();
    changed();
    done({});
    return {};
  }
  send_command({{"command", "stop"}}, [this, before, done = std::move(done)](const std::string& error) {
    // A drive whose feed has ended has stopped. One that refuses goes on, and may be asked again.
    if (error.empty() || !feed_) return done({});
    step_ = before;
    changed();
    done(error);
  });
  changed();
  return {};
}

Status DriveControl::mark(const std::string& note, std::function<void(const std::string& error)> done) {
  if (Status checked = check_note(note); !checked.ok()) return checked;
  if (!feed_ || is_replay_) return Error{ErrorCode::Unavailable, "no drive is recorded that could be marked"};
  constexpr std::size_t kMostOpen = 100;
  if (commands_.size() >= kMostOpen) return Error{ErrorCode::Unavailable, "the drive does not answer: try again"};
  send_command({{"command", "mark"}, {"note", note}}, std::move(done));
  return {};
}

}  // namespace hueline::console
