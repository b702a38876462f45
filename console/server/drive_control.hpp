#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "console/server/alarms.hpp"
#include "console/server/feed_link.hpp"
#include "console/server/places.hpp"
#include "console/server/programs.hpp"
#include "core/child.hpp"
#include "core/result.hpp"

namespace hueline::console {

/// The drive, as the console controls it: it starts and stops programs, and finds a drive that runs already, which it
/// knows by the feed's socket in its folder. A drive does not depend on the console: killed and started again, the
/// console finds it.
/// Thread safety: none; all functions and callbacks on the thread of `io`.
class DriveControl {
 public:
  DriveControl(boost::asio::io_context& io, Places places);

  /// Begins to look for drives, and to watch the programs.
  void start();
  /// Called when state_json() has changed.
  std::function<void()> on_change;

  /// The alarms of a running capture. Those of a replay are of another day: the page shows them, and nobody is called.
  Alarms& alarms() { return alarms_; }
  /// An operator has seen a warning or alarm of the running capture, by its id (Alarms).
  void acknowledge(const std::string& alarm);
  /// Tells the page why alarms cannot be heard from this computer; empty: they can.
  void set_sound_trouble(const std::string& why);

  nlohmann::ordered_json state_json() const;
  nlohmann::ordered_json check_json() const;
  const Places& places() const { return places_; }
  /// Returns the socket of the running drive's feed; empty while there is none.
  std::filesystem::path feed() const { return feed_ ? feed_path_ : std::filesystem::path(); }

  // The operator's commands. Errors: Invalid (a wrong value), Unavailable (the wrong state), Io.
  Status check(const std::string& rig, double seconds);
  /// Returns the name of the drive. `checked` points of the rig's checklist are done; it needs a reason if some are
  /// not.
  Result<std::string> drive(const std::string& rig, const std::string& name, const std::string& scenario,
                            const std::string& override_reason, std::size_t checked);
  /// Replays a drive for looking at, from `from_s` after its first packet.
  Result<std::string> replay(const std::string& drive, double speed, double from_s);
  /// Pauses the running replay or lets it go on, and changes its speed; what is not given stays as it is. `done` gets
  /// the answer of the replay: empty if it runs so.
  Status pace(std::optional<bool> is_paused, std::optional<double> speed,
              std::function<void(const std::string& error)> done);
  /// Lets the running replay go on from another second of the drive, at the same speed, paused if it is. For this it
  /// begins again.
  Status seek(double position_s);
  /// `done` gets the answer of the running drive: empty if it ends.
  Status stop(std::function<void(const std::string& error)> done);
  /// `done` gets the answer of the running drive: empty if the mark is in the journal.
  Status mark(const std::string& note, std::function<void(const std::string& error)> done);

 private:
  enum class Step { Idle, Rendering, Starting, Running, Stopping };
  /// How a replay runs.
  struct Replay {
    double speed = 1, from_s = 0;
    bool is_paused = false;
    std::optional<double> duration_s;
  };
  void look();
  void watch_programs();
  void find_feed();
  bool try_feed(const std::filesystem::path& socket);
  void take_end(const char* what, Child& child);
  Status run_capture(const std::string& rig);
  void take_status(const std::string& json);
  Status run_replay(const Replay& wanted);
  void run_next_replay();
  void send_command(nlohmann::ordered_json command, std::function<void(const std::string& error)> done);
  void changed();
  bool is_busy() const;
  const char* state_word() const;

  boost::asio::io_context& io_;
  const Places places_;
  const Programs programs_;
  boost::asio::steady_timer timer_;
  Step step_ = Step::Idle;
  bool is_replay_ = false;
  std::string drive_, rig_, scenario_, since_;
  Child capture_, player_, renderer_, checker_;
  Replay replay_;               // the running one
  std::optional<Replay> next_;  // begins when the running one has ended
  std::filesystem::path feed_path_;
  std::optional<std::uint32_t> status_channel_;
  std::optional<std::chrono::steady_clock::time_point> status_at_;  // when the last status of this feed came
  Alarms alarms_;
  std::string sound_trouble_;
  std::shared_ptr<FeedLink> feed_;  // while a drive runs: for its hello and for commands
  std::chrono::steady_clock::time_point looked_{};
  nlohmann::ordered_json last_, check_;
  std::uint64_t next_command_ = 1;
  std::map<std::uint64_t, std::function<void(const std::string&)>> commands_;
  std::string
      first_note_;  // the drive's first mark: why it was started though not ready, what of the checklist is done
  std::string told_;
};

}  // namespace hueline::console
