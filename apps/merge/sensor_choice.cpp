#include "apps/merge/sensor_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "config/rig_difference.hpp"
#include "core/number_word.hpp"

namespace hueline::apps {
namespace {

using drivers::Role;

/// Where a sensor stands in the recordings.
struct Places {
  const config::Sensor* sensor = nullptr;     // of the vehicle's rig; null: it lacks it
  std::vector<std::size_t> listed, recorded;  // recordings whose rigs list it; which have packets of it
};

SensorId id_in(const SurveyedJournal& journal, const std::string& name) {
  for (const auto& sensor : journal.recording.rig.sensors)
    if (sensor.name == name) return sensor.id;
  return kSystemSensor;
}

class Choice {
 public:
  Choice(const MergeWish& wish, const std::vector<SurveyedJournal>& journals) : wish_(wish), journals_(journals) {
    for (const auto& sensor : wish.rig.sensors) places_[sensor.name].sensor = &sensor;
    for (std::size_t i = 0; i < journals.size(); ++i)
      for (const auto& sensor : journals[i].recording.rig.sensors) {
        Places& places = places_[sensor.name];
        places.listed.push_back(i);
        if (sensor.id < journals[i].wire.size() && journals[i].wire[sensor.id] > 0) places.recorded.push_back(i);
      }
  }

  Result<SensorChoice> decide() {
    if (Status read = read_wish(); !read.ok()) return read.error();
    SensorChoice out;
    for (const SurveyedJournal& journal : journals_) {
      out.sensors.emplace_back(journal.recording.rig.sensors.size() + 1);
      out.sensors.back()[kSystemSensor] = kSystemSensor;
    }
    for (const auto& [name, places] : places_) {
      if (std::ranges::find(wish_.without, name) != wish_.without.end()) continue;
      const auto from = choose(name, places, out.warnings);
      if (!from.ok()) return from.error();
      for (const std::size_t i : *from) {
        const SurveyedJournal& journal = journals_[i];
        const SensorId id = id_in(journal, name);
        if (Status same = compare(journal, journal.recording.rig.sensors[id - 1u], *places.sensor, out.warnings);
            !same.ok())
          return same.error();
        out.sensors[i][id] = places.sensor->id;
      }
    }
    return out;
  }

 private:
  std::string listed_names() const {
    std::string out;
    for (const auto& [name, places] : places_)
      if (!places.listed.empty()) out += (out.empty() ? "" : ", ") + name;
    return out;
  }

  Status read_wish() {
    const auto is_listed = [&](const std::string& name) {
      const auto found = places_.find(name);
      return found != places_.end() && !found->second.listed.empty();
    };
    for (const std::string& name : wish_.without)
      if (!is_listed(name))
        return Error{ErrorCode::Invalid,
                     fmt::format("--without {}: no recording has such a sensor; there are: {}", name, listed_names())};
    for (const std::string& word : wish_.take) {
      const std::size_t split = word.find('=');
      const std::string name = word.substr(0, split);
      const std::string digits = split == std::string::npos ? std::string() : word.substr(split + 1);
      const std::size_t number = parse_number<std::size_t>(digits).value_or(0);
      if (number < 1 || number > journals_.size())
        return Error{ErrorCode::Invalid,
                     fmt::format("--take {}: give a sensor and the number of a recording from 1 to {}, such as laser=2",
                                 word, journals_.size())};
      const SurveyedJournal& journal = journals_[number - 1];
      if (id_in(journal, name) == kSystemSensor)
        return Error{ErrorCode::Invalid, fmt::format("--take {}: {} has no sensor {}", word, journal.name, name)};
      if (!taken_.emplace(name, number - 1).second)
        return Error{ErrorCode::Invalid, fmt::format("--take names {} twice", name)};
    }
    return {};
  }

  /// Returns whether the recordings with packets of a sensor have one after another what one device has sent.
  bool are_parts(const std::string& name, const Places& places) const {
    const auto span = [&](std::size_t i) { return journals_[i].spans[id_in(journals_[i], name)]; };
    if (!wish_.is_same_clock || places.recorded.size() < 2) return false;
    for (const std::size_t a : places.recorded)
      for (const std::size_t b : places.recorded)
        if (a < b && !span(a).is_apart_from(span(b))) return false;
    return true;
  }

  /// Returns the recordings from which a sensor comes; none if no recording lists it.
  Result<std::vector<std::size_t>> choose(const std::string& name, const Places& places,
                                          std::vector<std::string>& warnings) {
    using Chosen = std::vector<std::size_t>;
    if (places.listed.empty()) {
      warnings.push_back(fmt::format("no recording has the sensor {} of {}", name, wish_.rig_name));
      return Chosen();
    }
    if (!places.sensor)
      return Error{ErrorCode::Invalid,
                   fmt::format("{} has a sensor {} that {} lacks: enter it there, or leave it out with --without {}",
                               journals_[places.listed.front()].name, name, wish_.rig_name, name)};
    std::size_t from = places.recorded.empty() ? places.listed.front() : places.recorded.front();
    const Role role = places.sensor->type->role;
    if (const auto wished = taken_.find(name); wished != taken_.end()) {
      from = wished->second;
    } else if (are_parts(name, places)) {
      return places.recorded;
    } else if (places.recorded.size() > 1 && role != Role::Pps && role != Role::Pos) {
      return Error{ErrorCode::Invalid,
                   fmt::format("{} and {} both have packets of the sensor {}: say from which it is taken with --take "
                               "{}={}, or give the two devices different names",
                               journals_[places.recorded[0]].name, journals_[places.recorded[1]].name, name, name,
                               places.recorded[0] + 1)};
    }
    if (role == Role::Pps && from > 0 && !wish_.is_same_clock)
      return Error{ErrorCode::Invalid,
                   fmt::format("the pulses of {} come from {}, but the clock is that of {}, and an edge is stamped by "
                               "the clock that saw it: name the recording first whose pulses are to be used",
                               name, journals_[from].name, journals_[0].name)};
    return Chosen{from};
  }

  Status compare(const SurveyedJournal& journal, const config::Sensor& own, const config::Sensor& vehicle,
                 std::vector<std::string>& warnings) const {
    if (own.type != vehicle.type)
      return Error{ErrorCode::Invalid,
                   fmt::format("the sensor {} is a {} in {}, and a {} in {}: give the two different names", own.name,
                               own.driver(), journal.name, vehicle.driver(), wish_.rig_name)};
    const auto differences = config::sensor_differences(journal.recording.rig.text, wish_.rig.text, own.name);
    if (differences.empty()) return {};
    const config::KeyDifference& one = differences.front();
    std::string what = fmt::format("the sensor {} has {}: {} in {}, and {} in {}", own.name, one.key, one.first,
                                   journal.name, one.second, wish_.rig_name);
    if (differences.size() > 1) what += fmt::format(" (and {} other keys that differ)", differences.size() - 1);
    if (!wish_.rig_decides)
      return Error{ErrorCode::Invalid,
                   fmt::format("{}: correct {}, or give --rig-decides if it is right", what, wish_.rig_name)};
    warnings.push_back(fmt::format("{}: {} is used", what, wish_.rig_name));
    return {};
  }

  const MergeWish& wish_;
  const std::vector<SurveyedJournal>& journals_;
  std::map<std::string, Places> places_;
  std::map<std::string, std::size_t> taken_;
};

}  // namespace

Result<SensorChoice> choose_sensors(const MergeWish& wish, const std::vector<SurveyedJournal>& journals) {
  return Choice(wish, journals).decide();
}

}  // namespace hueline::apps
