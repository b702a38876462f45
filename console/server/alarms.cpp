#include "console/server/alarms.hpp"

#include <algorithm>
#include <utility>

#include "console/server/json_fields.hpp"

namespace hueline::console {

using nlohmann::ordered_json;

void Alarms::take(const ordered_json& status) {
  std::set<std::string> alarms, warnings;
  const auto note = [&](const std::string& sensor, const ordered_json& troubles) {
    for (const ordered_json& one : troubles) {
      const std::string level = text_in(one, "level");
      if (level != "alarm" && level != "warning") continue;
      (level == "alarm" ? alarms : warnings).insert(sensor + " " + text_in(one, "trouble") + " " + level);
    }
  };
  note("drive", list_in(status, "troubles"));
  for (const ordered_json& sensor : list_in(status, "sensors"))
    note(text_in(sensor, "name"), list_in(sensor, "troubles"));
  for (const std::string& one : warnings) warnings_begun_ += !warnings_.contains(one);
  alarms_ = std::move(alarms);
  warnings_ = std::move(warnings);
  change();
}

void Alarms::set(const std::string& own, bool is_there) {
  if (is_there)
    own_.insert(own);
  else
    own_.erase(own);
  change();
}

void Alarms::end_drive() {
  alarms_.clear();
  warnings_.clear();
  own_.erase(kSilent);
  change();
}

void Alarms::acknowledge(const std::string& id) {
  if (id == kEnded)
    own_.erase(id);
  else
    acknowledged_.insert(id);  // and change() forgets what does not last
  change();
}

void Alarms::change() {
  std::erase_if(acknowledged_, [this](const std::string& id) {
    return !alarms_.contains(id) && !warnings_.contains(id) && !own_.contains(id);
  });
  const auto is_new = [this](const std::string& id) { return !acknowledged_.contains(id); };
  const std::pair now{std::ranges::any_of(alarms_, is_new) || std::ranges::any_of(own_, is_new), warnings_begun_};
  if (now != std::exchange(told_, now) && on_change) on_change(now.first, now.second);
}

}  // namespace hueline::console
