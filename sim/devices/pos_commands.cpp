#include "sim/devices/pos_commands.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "sim/wire/novatel_encode.hpp"

namespace hueline::sim {
namespace {

constexpr std::string_view kOk = "\r\n<OK\r\n[ICOM1]";
constexpr std::string_view kUnknownLog = "\r\n<ERROR:Invalid Message. Field = 1\r\n[ICOM1]";
constexpr std::string_view kBadTrigger = "\r\n<ERROR:Invalid Trigger. Field = 2\r\n[ICOM1]";
constexpr std::string_view kBadPeriod = "\r\n<ERROR:Invalid Period. Field = 3\r\n[ICOM1]";
constexpr std::string_view kUnknownCommand = "\r\n<ERROR:Invalid Command Name\r\n[ICOM1]";
constexpr std::string_view kAcknowledged[] = {
    "SETINSTRANSLATION", "SETINSROTATION", "SETINSPROFILE", "INSCOMMAND",   "ALIGNMENTMODE", "EVENTINCONTROL",
    "EVENTOUTCONTROL",   "PPSCONTROL",     "INTERFACEMODE", "SERIALCONFIG", "CONNECTIMU",    "SETIMUTOANTOFFSET",
    "CLOCKADJUST",       "SAVECONFIG",     "ANTENNAPOWER",  "RTKSOURCE",    "NMEATALKER"};

std::vector<std::string> upper_words(std::string_view line) {
  std::vector<std::string> words(1);
  for (const char c : line) {
    if (std::isspace(static_cast<unsigned char>(c)) != 0 || c == ',') {
      if (!words.back().empty()) words.emplace_back();
    } else {
      words.back() += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

bool is_port(const std::string& word) {
  if (word == "THISPORT") return true;
  for (const std::string_view kind : {"COM", "ICOM", "USB", "NCOM", "SCOM", "CCOM"}) {
    if (word.size() == kind.size() + 1 && word.starts_with(kind) && word.back() >= '0' && word.back() <= '9')
      return true;
  }
  return false;
}

/// Returns the id of the log with a name in binary form, such as INSPVASB; empty if the name is unknown or not of the
/// binary form.
std::optional<std::uint16_t> log_id(const std::string& word) {
  if (!word.ends_with('B')) return {};
  const std::string_view stem = std::string_view(word).substr(0, word.size() - 1);
  for (const NovatelLog& log : novatel_logs()) {
    if (log.name == stem) return static_cast<std::uint16_t>(log.id);
  }
  return {};
}

}  // namespace

std::string PosSubscriptions::execute(std::string_view line) {
  std::vector<std::string> words = upper_words(line);
  if (words.empty()) return {};
  const std::string command = words.front();
  words.erase(words.begin());
  if (command == "UNLOGALL") {
    wishes_.clear();
    return std::string(kOk);
  }
  if (command == "LOG" || command == "UNLOG") {
    if (!words.empty() && is_port(words.front())) words.erase(words.begin());
    return command == "LOG" ? add(words) : remove(words);
  }
  if (std::find(std::begin(kAcknowledged), std::end(kAcknowledged), command) != std::end(kAcknowledged)) {
    return std::string(kOk);
  }
  return std::string(kUnknownCommand);
}

std::string PosSubscriptions::add(const std::vector<std::string>& words) {
  if (words.empty()) return std::string(kUnknownLog);
  const auto id = log_id(words[0]);
  if (!id) return std::string(kUnknownLog);
  Wish wish;
  wish.id = *id;
  const std::string trigger = words.size() > 1 ? words[1] : "ONCE";
  if (trigger == "ONTIME") {
    double seconds = 0;
    const std::string period = words.size() > 2 ? words[2] : "";
    const auto parsed = std::from_chars(period.data(), period.data() + period.size(), seconds);
    if (parsed.ec != std::errc() || !(seconds >= 0.001 && seconds <= 86400.0)) return std::string(kBadPeriod);
    wish.period_ms = static_cast<std::uint32_t>(std::lround(seconds * 1000));
  } else if (trigger == "ONCE") {
    wish.is_once = true;
  } else if (trigger != "ONNEW" && trigger != "ONCHANGED" && trigger != "ONALL") {
    return std::string(kBadTrigger);
  }
  std::erase_if(wishes_, [&](const Wish& w) { return w.id == *id; });
  wishes_.push_back(wish);
  return std::string(kOk);
}

std::string PosSubscriptions::remove(const std::vector<std::string>& words) {
  const auto id = words.empty() ? std::nullopt : log_id(words[0]);
  if (!id) return std::string(kUnknownLog);
  std::erase_if(wishes_, [&](const Wish& w) { return w.id == *id; });
  return std::string(kOk);
}

bool PosSubscriptions::wants(const NovatelPeek& peek) {
  const auto wish = std::find_if(wishes_.begin(), wishes_.end(), [&](const Wish& w) { return w.id == peek.id; });
  if (wish == wishes_.end()) return false;
  if (wish->is_once) {
    wishes_.erase(wish);
    return true;
  }
  if (wish->period_ms == 0) return true;
  const std::uint32_t period = peek.milliseconds / wish->period_ms;
  const bool is_due = wish->last_period ? period != *wish->last_period : peek.milliseconds % wish->period_ms == 0;
  wish->last_period = period;
  return is_due;
}

}  // namespace hueline::sim
