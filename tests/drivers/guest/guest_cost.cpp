#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "drivers/gige/aravis_source.hpp"
#include "drivers/gige/image_decoder.hpp"
#include "drivers/guest/guest_source.hpp"
#include "drivers/transport/host_clock.hpp"
#include "tests/drivers/gige/emulated_camera.hpp"
#include "tests/drivers/transport/network_lab.hpp"

// Measures what it costs that the receiver of a camera is a process of its own. The same camera and the same reader are
// used with Aravis in this process and in a guest, alternately in one run. Usage: guest_cost [MB_PER_SECOND
// [SECONDS_A_TURN [TURNS]]]. docs/performance.md has the figures.
namespace hueline::drivers {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kWidth = 2448, kHeight = 6 * 2048;  // six sensors stacked
constexpr double kImageBytes = double{kWidth} * kHeight;

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6; }

struct Use {
  double cpu_s = 0;
  std::int64_t faults = 0, switches = 0;
};
/// Returns what this process and the guests that have ended have used.
Use used() {
  Use use;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(who, &usage);
    use.cpu_s += seconds(usage.ru_utime) + seconds(usage.ru_stime);
    use.faults += usage.ru_minflt;
    use.switches += usage.ru_nvcsw + usage.ru_nivcsw;
  }
  return use;
}

struct Turn {
  double seconds = 0, cpu_s = 0;
  std::int64_t images = 0, incomplete = 0, wrong = 0, lost = 0, page_faults = 0, switches = 0;
  std::uint64_t sum = 0;
};

Turn read(PacketSource& source, nanoseconds time) {
  const Use before = used();
  Turn turn;
  for (;;) {
    const Status opened = source.open();
    if (opened.ok()) break;
    if (opened.error().code != ErrorCode::TimedOut) {
      fmt::print(stderr, "{}\n", opened.error().message);
      std::exit(1);
    }
  }
  ImageDecoder decoder({});
  const HostTime begin = host_now();
  while (host_now() - begin < time) {
    auto packet = source.next({});
    if (!packet) {
      if (packet.error().code == ErrorCode::TimedOut) continue;
      fmt::print(stderr, "{}\n", packet.error().message);
      std::exit(1);
    }
    if (packet->kind == PacketKind::Fault) continue;
    // The recorder reads every byte once.
    const auto bytes = packet->bytes.bytes();
    for (std::size_t at = 0; at + 8 <= bytes.size(); at += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes.data() + at, 8);
      turn.sum += word;
    }
    std::vector<Measurement> out;
    decoder.decode(*packet, out);
    for (const auto& m : out) {
      if (const auto* fault = std::get_if<Fault>(&m)) turn.lost += static_cast<std::int64_t>(fault->count);
      const auto* image = std::get_if<Image>(&m);
      if (!image) continue;
      ++turn.images;
      turn.incomplete += !image->is_complete;
      // Only every tenth image is checked by its pixels, because checking all would be most of the cost.
      if (image->is_complete && turn.images % 10 == 1) turn.wrong += !test::EmulatedCamera::is_as_painted(*image);
    }
  }
  turn.seconds = to_seconds(host_now() - begin);
  source.close();
  const Use after = used();
  turn.cpu_s = after.cpu_s - before.cpu_s;
  turn.page_faults = after.faults - before.faults;
  turn.switches = after.switches - before.switches;
  return turn;
}

int run(double megabytes, double time_s, int turns) {
  if (!test::enter_own_network()) fmt::print("no network of its own: on the machine's loopback\n");
  const double rate_hz = megabytes * 1e6 / kImageBytes;
  int ready[2];
  if (::pipe2(ready, O_CLOEXEC) != 0) return 1;
  const pid_t camera = ::fork();
  if (camera == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    test::EmulatedCamera emulated({"127.0.0.1", kWidth, kHeight, rate_hz, 1.25 * megabytes * 1e6});
    const char is_good = emulated.problem().empty();
    if (::write(ready[1], &is_good, 1) != 1 || !is_good) ::_exit(1);
    for (;;) ::pause();
  }
  char is_good = 0;
  if (::read(ready[0], &is_good, 1) != 1 || !is_good) return 1;

  GenicamConfig config;
  config.address = config.interface = "127.0.0.1";
  config.width = kWidth;
  config.height = kHeight;
  GuestSource::Config guest;
  guest.driver = "genicam";
  guest.text = config.to_text();
  fmt::print("{} x {} at {:.2f} Hz: {:.0f} MB/s, {} turns of {:.0f} s each\n", kWidth, kHeight, rate_hz, megabytes,
             turns, time_s);
  fmt::print("{:<12} {:>9} {:>10} {:>6} {:>11} {:>12} {:>12}\n", "Aravis is", "images/s", "incomplete", "lost",
             "CPU s / s", "page faults", "switches");
  Turn sums[2];
  bool is_right = true;
  for (int turn = 0; turn < 2 * turns; ++turn) {
    const bool is_guest = turn % 2;
    std::unique_ptr<PacketSource> source;
    if (is_guest)
      source = std::make_unique<GuestSource>(guest);
    else
      source = std::make_unique<AravisSource>(config);
    const Turn made = read(*source, from_seconds(time_s));
    fmt::print("{:<12} {:9.2f} {:10} {:6} {:11.3f} {:12} {:12}\n", is_guest ? "a guest" : "in process",
               static_cast<double>(made.images) / made.seconds, made.incomplete, made.lost, made.cpu_s / made.seconds,
               made.page_faults, made.switches);
    is_right &= made.wrong == 0 && made.sum != 0 && static_cast<double>(made.images) > 0.5 * rate_hz * made.seconds;
    Turn& sum = sums[is_guest];
    sum.seconds += made.seconds;
    sum.cpu_s += made.cpu_s;
    sum.images += made.images;
    sum.incomplete += made.incomplete;
    sum.lost += made.lost;
  }
  for (const bool is_guest : {false, true}) {
    const Turn& sum = sums[is_guest];
    fmt::print("{}: {:.2f} images/s, {} incomplete, {} lost, {:.3f} of a core\n", is_guest ? "a guest" : "in process",
               static_cast<double>(sum.images) / sum.seconds, sum.incomplete, sum.lost, sum.cpu_s / sum.seconds);
  }
  fmt::print("{}\n", is_right ? "all images looked at were as sent" : "FAILED: images missing or not as sent");
  ::kill(camera, SIGKILL);
  ::waitpid(camera, nullptr, 0);
  return is_right ? 0 : 1;
}

}  // namespace
}  // namespace hueline::drivers

int main(int argc, char** argv) {
  const auto argument = [&](int at, double usual) { return argc > at ? std::atof(argv[at]) : usual; };
  return hueline::drivers::run(argument(1, 300), argument(2, 10), static_cast<int>(argument(3, 3)));
}
