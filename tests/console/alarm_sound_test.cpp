#include "console/server/alarm_sound.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <thread>

#include "tests/support/temporary_folder.hpp"

namespace hueline::console {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A sound device that appends what it plays to a file: ALSA's own plugin, whose pipe outlives no sound.
struct RecordedSound {
  test::TemporaryFolder folder;
  std::filesystem::path file = folder / "played.raw";
  std::string device = fmt::format("file:'| cat >> {}',raw", file.string());

  std::vector<std::int16_t> samples() const {
    const std::string bytes = test::contents(file);
    std::vector<std::int16_t> out(bytes.size() / sizeof(std::int16_t));
    if (!out.empty()) std::memcpy(out.data(), bytes.data(), out.size() * sizeof(std::int16_t));
    return out;
  }
  /// Waits until so many seconds of sound are there.
  bool has(double seconds) const {
    for (int i = 0; i < 1000; ++i, std::this_thread::sleep_for(10ms))
      if (static_cast<double>(samples().size()) >= seconds * 48'000) return true;
    return false;
  }
};

/// Returns the frequencies of the tones between silences, Hz, to the nearest ten.
std::vector<int> tones(const std::vector<std::int16_t>& samples) {
  std::vector<int> out;
  std::size_t begin = 0, crossings = 0, quiet = 0;
  int sign = 0;
  const auto end_tone = [&](std::size_t end) {
    const double length_s = static_cast<double>(end - begin) / 48'000;
    if (crossings > 10)
      out.push_back(10 * static_cast<int>(std::lround(static_cast<double>(crossings) / 2 / length_s / 10)));
    crossings = 0;
  };
  for (std::size_t i = 0; i < samples.size(); ++i) {
    quiet = samples[i] == 0 ? quiet + 1 : 0;
    const int now = samples[i] > 0 ? 1 : samples[i] < 0 ? -1 : sign;
    if (quiet == 100) end_tone(i - quiet);
    if (quiet > 0) continue;
    if (crossings == 0) begin = i;
    if (now != sign) ++crossings;
    sign = now;
  }
  end_tone(samples.size() - quiet);
  return out;
}

constexpr double kAlarm_s = 3 * 0.18, kWarning_s = 0.27;

TEST(AlarmSound, IsHighLowHighAndComesAgainUntilTheAlarmIsOver) {
  const RecordedSound recorded;
  {
    AlarmSound sound(recorded.device, [](const std::string& trouble) { ADD_FAILURE() << trouble; });
    sound.set(true, 0);
    ASSERT_TRUE(recorded.has(2 * kAlarm_s));
    sound.set(false, 0);
    std::this_thread::sleep_for(3s);
  }
  EXPECT_THAT(tones(recorded.samples()), ElementsAre(880, 590, 880, 880, 590, 880));
}

TEST(AlarmSound, IsOneSofterLowToneForAWarning) {
  const RecordedSound recorded;
  {
    AlarmSound sound(recorded.device, [](const std::string& trouble) { ADD_FAILURE() << trouble; });
    sound.set(false, 1);
    ASSERT_TRUE(recorded.has(kWarning_s));
    sound.set(false, 1);  // no other one
    std::this_thread::sleep_for(300ms);
    sound.try_out();
    ASSERT_TRUE(recorded.has(kWarning_s + kAlarm_s));
  }
  const auto played = recorded.samples();
  EXPECT_THAT(tones(played), ElementsAre(440, 880, 590, 880));
  const auto loudest = [&](double begin_s, double end_s) {
    return *std::max_element(played.begin() + static_cast<long>(begin_s * 48'000),
                             played.begin() + static_cast<long>(end_s * 48'000));
  };
  EXPECT_LT(loudest(0, kWarning_s), loudest(kWarning_s, kWarning_s + kAlarm_s) / 2);
}

TEST(AlarmSound, ThatNobodyCanHearIsToldOnceBeforeAnyAlarm) {
  std::vector<std::string> told;
  {
    AlarmSound sound("no_such_device", [&](const std::string& trouble) { told.push_back(trouble); });
    std::this_thread::sleep_for(200ms);
    sound.set(true, 0);
    std::this_thread::sleep_for(200ms);
  }
  EXPECT_THAT(told, ElementsAre(testing::AllOf(HasSubstr("no_such_device"), HasSubstr("--sound"))));
}

TEST(AlarmSound, OfADeviceThatComesLaterIsHeard) {
  const test::TemporaryFolder folder;
  const auto file = folder / "not yet" / "played.raw";
  std::vector<std::string> told;  // by the sound's own thread
  std::atomic<int> count = 0;
  {
    AlarmSound sound(fmt::format("file:'{}',raw", file.string()), [&](const std::string& trouble) {
      told.push_back(trouble);
      ++count;
    });
    sound.set(true, 0);
    std::this_thread::sleep_for(500ms);
    std::filesystem::create_directories(file.parent_path());
    for (int i = 0; i < 1000 && count < 2; ++i) std::this_thread::sleep_for(10ms);
  }
  EXPECT_THAT(told, ElementsAre(HasSubstr("no alarm can be heard"), IsEmpty()));
  EXPECT_GT(std::filesystem::file_size(file), 0u);
}

}  // namespace
}  // namespace hueline::console
