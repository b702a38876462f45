#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/mutex.hpp"
#include "core/result.hpp"

namespace hueline::console {

/// Sounds alarms through a sound device of this computer (ALSA), so that they are heard where no browser is open: an
/// alarm as high, low, high, again and again while it lasts; a new warning as one low tone, which is softer.
///
/// A thread of its own opens the device for each sound and closes it afterwards, so that other programs can use it and
/// one that is plugged in later is found. A device that fails is tried again while the alarm lasts. The first thing
/// that the thread does is to open it, so that a drive need not have an alarm before somebody knows that none is heard.
/// Thread safety: set() and try_out() may be called on any thread; they never wait for the device.
class AlarmSound {
 public:
  /// `device` is a name of ALSA such as "default" or "plughw:0". `on_trouble` is called on the sound's thread when the
  /// device begins to fail, with what to do, and with an empty text when it is well again.
  AlarmSound(std::string device, std::function<void(const std::string&)> on_trouble);
  AlarmSound(const AlarmSound&) = delete;
  AlarmSound& operator=(const AlarmSound&) = delete;

  /// Says whether an alarm lasts that nobody has acknowledged, and how many warnings have begun so far.
  void set(bool is_alarm, std::uint64_t warnings);
  /// Plays the alarm once, so that somebody can hear whether it is loud enough.
  void try_out();

 private:
  void run(const std::stop_token& stop);
  void play(const std::vector<std::int16_t>& samples, const std::function<bool()>& is_wanted);
  Status write(const std::vector<std::int16_t>& samples, const std::function<bool()>& is_wanted);

  const std::string device_;
  const std::function<void(const std::string&)> on_trouble_;
  Mutex mutex_;
  std::condition_variable_any changed_;
  bool is_broken_ = false;  // known to the thread alone
  bool is_alarm_ HUELINE_GUARDED_BY(mutex_) = false, is_tried_ HUELINE_GUARDED_BY(mutex_) = false;
  std::uint64_t warnings_ HUELINE_GUARDED_BY(mutex_) = 0, warnings_heard_ HUELINE_GUARDED_BY(mutex_) = 0;
  std::jthread thread_;  // its destructor ends it first of all
};

}  // namespace hueline::console
