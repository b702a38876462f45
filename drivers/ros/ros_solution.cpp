#include "drivers/ros/ros_solution.hpp"

#include <cmath>
#include <string>

#include "core/calendar.hpp"
#include "drivers/novatel/ascii.hpp"

namespace hueline::drivers {
namespace {

constexpr std::string_view kOfGpsDriver = "novatel_gps_msgs/";

/// Reads nov_header of novatel_oem7_msgs: name, id, type, sequence, time status, week, milliseconds.
std::optional<GpsTime> take_oem7_time(RosReader& in) {
  in.take_string();
  in.take<std::uint16_t>();
  in.take<std::uint8_t>();
  in.take<std::uint32_t>();
  in.take<std::uint8_t>();
  const auto week = in.take<std::uint16_t>();
  const auto ms = in.take<std::uint32_t>();
  if (!in.ok() || week == 0) return {};
  return from_gps_week(week, std::chrono::milliseconds(ms));
}

std::optional<GpsTime> time_in_week(std::uint32_t week, double in_week_s) {
  if (week == 0 || week > 10'000 || !(in_week_s >= 0) || !(in_week_s < static_cast<double>(kSecondsPerWeek))) return {};
  return from_gps_week(static_cast<int>(week), nanoseconds(std::llround(in_week_s * 1e9)));
}

/// Reads novatel_msg_header of novatel_gps_msgs, which ends with the state of the receiver.
std::optional<GpsTime> take_gps_driver_time(RosReader& in) {
  constexpr int kFlags = 23;
  in.take_string();  // the name of the log, then the port
  in.take_string();
  in.take<std::uint32_t>();  // sequence
  in.take<float>();          // idle time
  in.take_string();          // time status
  const auto week = in.take<std::uint32_t>();
  const auto in_week_s = in.take<double>();
  in.take<std::uint32_t>();  // state of the receiver: a word and its bits
  for (int i = 0; i < kFlags; ++i) in.take<std::uint8_t>();
  in.take<std::uint32_t>();  // version of the receiver's program
  return in.ok() ? time_in_week(week, in_week_s) : std::nullopt;
}

void take_values(RosReader& in, bool has_undulation, RosSolutionValues& out) {
  for (double& value : out.place) value = in.take<double>();
  if (has_undulation) out.place[2] += static_cast<double>(in.take<float>());  // above the geoid, plus its undulation
  for (auto* three : {&out.velocity, &out.angles})
    for (double& value : *three) value = in.take<double>();
}

void take_sigmas(RosReader& in, RosSolution& out) {
  out.sigma.emplace();
  for (float& value : *out.sigma) value = in.take<float>();
}

}  // namespace

bool carries_solution(std::string_view type) {
  return type == "novatel_oem7_msgs/INSPVA" || type == "novatel_gps_msgs/Inspva" || solution_states_sigmas(type);
}

bool solution_states_sigmas(std::string_view type) {
  return type == "novatel_oem7_msgs/INSPVAX" || type == "novatel_gps_msgs/Inspvax";
}

bool carries_solution_sigmas(std::string_view type) {
  return type == "novatel_oem7_msgs/INSSTDEV" || type == "novatel_gps_msgs/Insstdev";
}

std::optional<RosSolution> take_solution(std::string_view type, RosReader in) {
  if (!carries_solution(type) && !carries_solution_sigmas(type)) return {};
  const bool has_words = type.starts_with(kOfGpsDriver);
  RosSolution out;
  out.stamp = in.take_header().stamp;
  auto time = has_words ? take_gps_driver_time(in) : take_oem7_time(in);
  const auto take_status = [&] { return has_words ? ins_status_of(in.take_string()) : in.take<std::uint32_t>(); };
  if (solution_states_sigmas(type)) {
    RosSolutionValues& values = out.values.emplace();
    values.status = take_status();
    take_status();  // the kind of position
    take_values(in, true, values);
    take_sigmas(in, out);
  } else if (carries_solution(type)) {
    RosSolutionValues& values = out.values.emplace();
    if (has_words) {  // the time once more, finer than in the header
      const auto week = in.take<std::uint32_t>();
      time = time_in_week(week, in.take<double>());
    }
    take_values(in, false, values);
    values.status = take_status();
  } else {
    take_sigmas(in, out);
  }
  if (!in.ok() || !time) return {};
  out.time = *time;
  return out;
}

}  // namespace hueline::drivers
