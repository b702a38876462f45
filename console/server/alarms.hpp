#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

namespace hueline::console {

/// The warnings and alarms of the running drive, and which of them an operator has acknowledged. One is known by its
/// id, which the page makes in the same way: sensor, trouble and level with spaces between, such as "head gone alarm".
/// An alarm that is over and comes again is new. Thread safety: none.
class Alarms {
 public:
  /// The capture says nothing; the page has this id too.
  static constexpr const char* kSilent = "console link";
  /// The capture has ended although nobody had asked it to. Who acknowledges it ends it.
  static constexpr const char* kEnded = "console ended";

  /// Called when something of this has changed: whether an alarm lasts that nobody has acknowledged, and how many
  /// warnings have begun so far.
  std::function<void(bool is_alarm, std::uint64_t warnings)> on_change;

  /// Takes the drive's state, a message of the feed's topic /hueline/status.
  void take(const nlohmann::ordered_json& status);
  /// Sets one of the console's own alarms.
  void set(const std::string& own, bool is_there);
  /// Forgets the troubles of a drive that has ended.
  void end_drive();
  /// Takes what an operator has seen. What is over by now needs no acknowledgement.
  void acknowledge(const std::string& id);
  /// Whether one of the console's own is there.
  bool has(const std::string& own) const { return own_.contains(own); }
  /// The ids that are acknowledged and last.
  nlohmann::ordered_json acknowledged_json() const { return acknowledged_; }

 private:
  void change();

  std::set<std::string> alarms_, warnings_, own_, acknowledged_;
  std::uint64_t warnings_begun_ = 0;
  std::pair<bool, std::uint64_t> told_{};  // what on_change was told last
};

}  // namespace hueline::console
