#include "apps/capture/followers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <sstream>
#include <thread>
#include <utility>

#include "apps/exit_code.hpp"
#include "apps/key_options.hpp"
#include "apps/log.hpp"
#include "core/output_file.hpp"

namespace hueline::apps {
namespace {

constexpr std::chrono::milliseconds kLook{50};
constexpr std::chrono::seconds kTellAfter{2};

/// Returns the last lines that a program printed, without the time that its log puts before each.
std::vector<std::string> last_words(const std::filesystem::path& said) {
  constexpr std::size_t kTime = 9;  // "18:06:15 "
  std::vector<std::string> out;
  std::istringstream lines(last_lines(said, 1000));
  for (std::string line; std::getline(lines, line);)
    out.push_back(line.size() > kTime && line[2] == ':' && line[5] == ':' ? line.substr(kTime) : line);
  return out;
}

/// Returns the options of a command that the keys of a rig stand for.
template <class Keys>
std::vector<std::string> options_for(Keys keys) {
  Keys defaults;
  return option_words(group_of(keys), group_of(defaults));
}

}  // namespace

Followers::Followers(const config::Rig& rig, const std::filesystem::path& drive) : drive_(drive) {
  if (rig.panoramas) start("panoramas", {"panorama", drive.string()}, options_for(*rig.panoramas));
  if (rig.images)
    start("images", {"export", drive.string(), "--profile", "images", "--points", "0"}, options_for(*rig.images));
}

void Followers::start(const std::string& product, const std::vector<std::string>& command,
                      const std::vector<std::string>& options) {
  Follower one;
  one.product = product;
  one.said = drive_ / (product + ".log");
  std::vector<std::string> words{program_beside_this("hueline").string()};
  words.insert(words.end(), command.begin(), command.end());
  words.insert(words.end(), {"--out", (drive_ / product).string()});
  words.insert(words.end(), options.begin(), options.end());
  one.again = fmt::format("hueline {}", fmt::join(words.begin() + 1, words.end(), " "));
  words.emplace_back("--follow");
  // The program may not make it in a folder that the capture holds.
  std::error_code refused;
  std::filesystem::create_directory(drive_ / product, refused);
  auto child = refused ? Result<Child>(output_error("make folder " + (drive_ / product).string(), refused.value()))
                       : Child::start(words, one.said);
  if (child.ok()) {
    one.child = *child;
  } else {
    one.is_over = true;
    log_warning("{}: {}; after the drive: {}", product, child.error().message, one.again);
  }
  followers_.push_back(std::move(one));
}

void Followers::take_end(Follower& one, bool is_drive_over) {
  const auto status = one.child.take_end();
  if (!status) return;
  one.is_over = true;
  one.is_whole = *status == kDone && is_drive_over;
  const auto words = last_words(one.said);
  if (!one.is_whole) {
    log_warning("{}: ended {}with status {}: {}; {} has all that it said; {} makes them again", one.product,
                is_drive_over ? "" : "before the drive, ", *status, words.empty() ? "not a word" : words.back(),
                one.said.string(), one.again);
    return;
  }
  for (const std::string& line : words) log_info("{}: {}", one.product, line);
}

void Followers::look(const runtime::DiskReserve& reserve) {
  const Status room = has_room_ && !followers_.empty() ? reserve.check(drive_) : Status();
  if (!room.ok()) has_room_ = false;
  for (Follower& one : followers_) {
    if (one.is_over) continue;
    if (!room.ok()) {
      log_warning("{}: {}: they end early", one.product, room.error().message);
      one.child.ask_to_end();
    }
    take_end(one, false);
  }
}

int Followers::finish(const StopSignals& signals) {
  const std::stop_token leave = signals.asked().stop_requested() ? signals.at_once() : signals.asked();
  const auto begin = std::chrono::steady_clock::now();
  bool is_told = false;
  int status = kDone;
  for (Follower& one : followers_) {
    for (take_end(one, true); !one.is_over && !leave.stop_requested(); take_end(one, true)) {
      if (!is_told && std::chrono::steady_clock::now() - begin > kTellAfter) {
        is_told = true;
        log_info("{}: they are still being made; Ctrl-C ends without the rest", one.product);
      }
      std::this_thread::sleep_for(kLook);
    }
    if (one.is_over) {
      if (!one.is_whole && status == kDone) status = kOutputRefused;
      continue;
    }
    one.child.ask_to_end();
    log_warning("{}: left unfinished; {} makes them all", one.product, one.again);
    status = kStopped;
  }
  return status;
}

}  // namespace hueline::apps
