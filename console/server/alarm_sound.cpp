#include "console/server/alarm_sound.hpp"

#include <alsa/asoundlib.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace hueline::console {
namespace {

using std::chrono::milliseconds;

constexpr unsigned kRate_hz = 48'000;
constexpr unsigned kLatency_us = 100'000;  // what the device has at most before it is played
constexpr std::size_t kBlock = kRate_hz / 20;
constexpr auto kRepeatAlarm = milliseconds(2500);  // of silence

/// Appends a tone and a short silence. The overtones of a square wave are heard above the noise of a car.
void add_tone(std::vector<std::int16_t>& out, double frequency_hz, double length_s, double loudness, bool is_square) {
  constexpr double kRamp_s = 0.01, kSilence_s = 0.02;
  const auto count = static_cast<std::size_t>(length_s * kRate_hz);
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / kRate_hz;
    const double wave = std::sin(2 * std::numbers::pi * frequency_hz * t);
    const double ramp = std::min({1.0, t / kRamp_s, (length_s - t) / kRamp_s});
    const double value = is_square ? (wave < 0 ? -1 : 1) : wave;
    out.push_back(static_cast<std::int16_t>(32767 * loudness * ramp * value));
  }
  out.insert(out.end(), static_cast<std::size_t>(kSilence_s * kRate_hz), std::int16_t{0});
}

// The tones are those of the page (console/web/src/state/alarms.ts).
std::vector<std::int16_t> alarm_pattern() {
  std::vector<std::int16_t> out;
  for (const double frequency_hz : {880.0, 587.0, 880.0}) add_tone(out, frequency_hz, 0.16, 0.5, true);
  return out;
}
std::vector<std::int16_t> warning_pattern() {
  std::vector<std::int16_t> out;
  add_tone(out, 440, 0.25, 0.2, false);
  return out;
}

struct Close {
  void operator()(snd_pcm_t* device) const { snd_pcm_close(device); }
};

void say_nothing(const char*, int, const char*, int, const char*, ...) {}

}  // namespace

AlarmSound::AlarmSound(std::string device, std::function<void(const std::string&)> on_trouble)
    : device_(std::move(device)), on_trouble_(std::move(on_trouble)) {
  snd_lib_error_set_handler(&say_nothing);  // what it would print is in the error that write() returns
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void AlarmSound::set(bool is_alarm, std::uint64_t warnings) {
  const Lock lock(mutex_);
  is_alarm_ = is_alarm;
  warnings_ = warnings;
  changed_.notify_all();
}

void AlarmSound::try_out() {
  const Lock lock(mutex_);
  is_tried_ = true;
  changed_.notify_all();
}

void AlarmSound::run(const std::stop_token& stop) {
  const auto alarm = alarm_pattern(), warning = warning_pattern();
  play({}, [] { return true; });
  while (!stop.stop_requested()) {
    bool is_tried = false, is_alarm = false;
    {
      Lock lock(mutex_);
      changed_.wait(lock, stop, [this]() HUELINE_REQUIRES(mutex_) {
        return is_tried_ || is_alarm_ || warnings_ != warnings_heard_;
      });
      if (stop.stop_requested()) return;
      is_tried = std::exchange(is_tried_, false);
      is_alarm = is_alarm_;
      warnings_heard_ = warnings_;
    }
    play(is_tried || is_alarm ? alarm : warning, [&] {
      const Lock lock(mutex_);
      return !stop.stop_requested() && (is_tried || !is_alarm || is_alarm_);
    });
    if (!is_alarm) continue;
    // An alarm that ends ends the waiting, too, so that a new one is heard at once.
    Lock lock(mutex_);
    changed_.wait_for(lock, stop, kRepeatAlarm, [this]() HUELINE_REQUIRES(mutex_) { return is_tried_ || !is_alarm_; });
  }
}

/// Plays the samples, and tells whether the device works.
void AlarmSound::play(const std::vector<std::int16_t>& samples, const std::function<bool()>& is_wanted) {
  const Status played = write(samples, is_wanted);
  if (played.ok() != std::exchange(is_broken_, !played.ok())) return;
  on_trouble_(played.ok() ? std::string() : played.error().message);
}

/// Opens the device for the samples, or as many of them as are wanted.
Status AlarmSound::write(const std::vector<std::int16_t>& samples, const std::function<bool()>& is_wanted) {
  const auto wrong = [this](const char* what, long code) {
    return Error{
        ErrorCode::Io,
        fmt::format("no alarm can be heard: the sound device '{}' {}: {}; `aplay -L` lists the devices, its user "
                    "must be in the group audio, and another one may be given with --sound",
                    device_, what, snd_strerror(static_cast<int>(code)))};
  };
  snd_pcm_t* opened = nullptr;
  if (const int failed = snd_pcm_open(&opened, device_.c_str(), SND_PCM_STREAM_PLAYBACK, 0); failed < 0)
    return wrong("cannot be opened", failed);
  const std::unique_ptr<snd_pcm_t, Close> device(opened);
  if (const int failed = snd_pcm_set_params(device.get(), SND_PCM_FORMAT_S16, SND_PCM_ACCESS_RW_INTERLEAVED, 1,
                                            kRate_hz, 1, kLatency_us);
      failed < 0)
    return wrong("takes no 16-bit sound of one channel at 48 kHz", failed);
  for (std::size_t at = 0; at < samples.size();) {
    if (!is_wanted()) {
      snd_pcm_drop(device.get());
      return {};
    }
    const std::size_t count = std::min(kBlock, samples.size() - at);
    snd_pcm_sframes_t written = snd_pcm_writei(device.get(), samples.data() + at, count);
    if (written < 0) written = snd_pcm_recover(device.get(), static_cast<int>(written), 1);
    if (written < 0) return wrong("does not play", written);
    at += static_cast<std::size_t>(written);
  }
  if (const int failed = snd_pcm_drain(device.get()); failed < 0) return wrong("does not play", failed);
  return {};
}

}  // namespace hueline::console
