#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <vector>

#include "drivers/gige/aravis_source.hpp"
#include "drivers/gige/image_decoder.hpp"
#include "drivers/guest/guest_source.hpp"
#include "drivers/transport/host_clock.hpp"
#include "tests/drivers/gige/emulated_camera.hpp"
#include "tests/drivers/gige/hostile_datagrams.hpp"
#include "tests/drivers/transport/network_lab.hpp"

// Cameras are lost, restarted and attacked, and guests are killed, many at a time and for as long as asked. Every image
// that comes is checked. Usage: guest_torture [--cameras N] [--losses N] [--restarts N] [--kills N] [--in-process]
// [--seed N]. It ends with 1 if an image is not what its camera sent, or if a camera is not back within a minute.
// --in-process runs Aravis in this process and shows what it does to a program.
namespace hueline::drivers {
namespace {

using namespace std::chrono_literals;

constexpr nanoseconds kForever = 60s;

struct Options {
  int cameras = 5, losses = 5, restarts = 5, kills = 10;
  bool is_in_process = false;
  unsigned seed = 1;
};

struct Tally {
  std::mutex mutex;
  std::map<std::string, int> ends;  // by how the source said that it was over
  std::uint64_t images = 0, incomplete = 0, wrong = 0;
  int not_back = 0, not_noticed = 0;
  std::vector<double> noticed_s, back_s;
};

enum class Trouble { Loss, Restart, Kill };

/// One camera with its reader, on its own address.
class Lane {
 public:
  Lane(int number, const Options& options, Tally& tally)
      : address_(fmt::format("127.0.1.{}", number + 1)), tally_(tally) {
    GenicamConfig config;
    config.address = config.interface = address_;
    config.width = 320;
    config.height = 240;
    if (options.is_in_process) {
      source_ = std::make_unique<AravisSource>(config);
    } else {
      GuestSource::Config guest;
      guest.driver = "genicam";
      guest.text = config.to_text();
      auto made = std::make_unique<GuestSource>(guest);
      guest_ = made.get();
      source_ = std::move(made);
    }
    switch_on();
  }

  bool come_back() {
    const HostTime begin = host_now();
    while (host_now() - begin < kForever) {
      const Status opened = source_->open();
      if (opened.ok()) {
        if (!read(3)) continue;
        std::lock_guard lock(tally_.mutex);
        tally_.back_s.push_back(to_seconds(host_now() - begin));
        return true;
      }
      if (opened.error().code != ErrorCode::TimedOut) std::this_thread::sleep_for(250ms);
    }
    std::lock_guard lock(tally_.mutex);
    ++tally_.not_back;
    return false;
  }

  void suffer(Trouble trouble) {
    const HostTime begin = host_now();
    if (trouble == Trouble::Kill && guest_) ::kill(guest_->guest_pid(), SIGKILL);
    if (trouble != Trouble::Kill) camera_.reset();
    if (trouble == Trouble::Restart) switch_on();
    while (host_now() - begin < kForever) {
      if (read(1)) continue;
      std::lock_guard lock(tally_.mutex);
      tally_.noticed_s.push_back(to_seconds(host_now() - begin));
      ++tally_.ends[ended_];
      source_->close();
      if (!camera_) switch_on();
      return;
    }
    std::lock_guard lock(tally_.mutex);
    ++tally_.not_noticed;
  }

 private:
  void switch_on() {
    // A guest of another lane that is just being started has copies of the old camera's sockets until it has closed
    // what is not its own.
    for (int tries = 0; tries < 40 && (tries == 0 || !camera_->problem().empty()); ++tries) {
      if (tries > 0) std::this_thread::sleep_for(50ms);
      camera_.emplace(test::EmulatedCamera::Config{address_, 320, 240, 20, 20e6});
    }
    if (!camera_->problem().empty()) {
      fmt::print(stderr, "{}: {}\n", address_, camera_->problem());
      std::exit(2);
    }
  }
  /// Returns false when the source is over.
  bool read(int images) {
    ImageDecoder decoder({});
    for (const HostTime begin = host_now(); images > 0 && host_now() - begin < 1s;) {
      auto packet = source_->next({});
      if (!packet) {
        if (packet.error().code == ErrorCode::TimedOut) continue;
        ended_ = packet.error().message;
        return false;
      }
      if (packet->kind == PacketKind::Fault) continue;
      std::vector<Measurement> out;
      decoder.decode(*packet, out);
      std::lock_guard lock(tally_.mutex);
      for (const auto& m : out) {
        const auto* image = std::get_if<Image>(&m);
        if (!image) continue;
        ++tally_.images;
        if (!image->is_complete)
          ++tally_.incomplete;
        else if (!test::EmulatedCamera::is_as_painted(*image))
          ++tally_.wrong;
        else
          --images;
      }
    }
    return true;
  }

  const std::string address_;
  Tally& tally_;
  std::unique_ptr<PacketSource> source_;
  GuestSource* guest_ = nullptr;
  std::optional<test::EmulatedCamera> camera_;
  std::string ended_;
};

std::string spread(std::vector<double> seconds) {
  if (seconds.empty()) return "none";
  std::ranges::sort(seconds);
  return fmt::format("median {:.2f} s, longest {:.2f} s", seconds[seconds.size() / 2], seconds.back());
}

int run(const Options& options) {
  if (!test::enter_own_network()) fmt::print("no network of its own: on the machine's loopback\n");
  std::vector<Trouble> troubles;
  troubles.insert(troubles.end(), static_cast<std::size_t>(options.losses), Trouble::Loss);
  troubles.insert(troubles.end(), static_cast<std::size_t>(options.restarts), Trouble::Restart);
  if (!options.is_in_process) troubles.insert(troubles.end(), static_cast<std::size_t>(options.kills), Trouble::Kill);
  std::mt19937 random(options.seed);
  std::ranges::shuffle(troubles, random);
  Tally tally;
  std::atomic<std::size_t> next{0};
  const HostTime begin = host_now();
  {
    std::vector<std::jthread> lanes;
    for (int i = 0; i < options.cameras; ++i)
      lanes.emplace_back([&, i] {
        Lane lane(i, options, tally);
        if (!lane.come_back()) return;
        for (std::size_t at = 0; (at = next++) < troubles.size();) {
          lane.suffer(troubles[at]);
          if (!lane.come_back()) return;
        }
      });
  }
  fmt::print("{} cameras, {} losses, {} restarts, {} guests killed in {:.0f} s, seed {}\n", options.cameras,
             options.losses, options.restarts, options.is_in_process ? 0 : options.kills,
             to_seconds(host_now() - begin), options.seed);
  fmt::print("images {}, {} of them incomplete, {} not as sent\n", tally.images, tally.incomplete, tally.wrong);
  fmt::print("noticed after: {}\nback after: {}\n", spread(tally.noticed_s), spread(tally.back_s));
  for (const auto& [end, count] : tally.ends) fmt::print("{:6} x {}\n", count, end);
  if (tally.not_noticed || tally.not_back)
    fmt::print("NOT NOTICED {}, NOT BACK {}\n", tally.not_noticed, tally.not_back);
  const bool is_good = tally.wrong == 0 && tally.not_noticed == 0 && tally.not_back == 0 && tally.images > 0;
  fmt::print("{}\n", is_good ? "every camera came back, every whole image was as sent" : "FAILED");
  return is_good ? 0 : 1;
}

}  // namespace
}  // namespace hueline::drivers

int main(int argc, char** argv) {
  hueline::drivers::Options options;
  const std::map<std::string_view, int*> numbers{{"--cameras", &options.cameras},
                                                 {"--losses", &options.losses},
                                                 {"--restarts", &options.restarts},
                                                 {"--kills", &options.kills}};
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--in-process") {
      options.is_in_process = true;
    } else if (i + 1 < argc && (numbers.contains(word) || word == "--seed")) {
      const int value = std::atoi(argv[++i]);
      if (word == "--seed")
        options.seed = static_cast<unsigned>(value);
      else
        *numbers.at(word) = value;
    } else {
      fmt::print(stderr,
                 "guest_torture [--cameras N] [--losses N] [--restarts N] [--kills N] [--in-process] [--seed N]\n");
      return 2;
    }
  }
  return hueline::drivers::run(options);
}
