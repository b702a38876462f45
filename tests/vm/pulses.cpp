#include <fcntl.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <thread>

#include "drivers/transport/host_clock.hpp"

// vm_pulses SOCKET: the pulse per second of `hueline simulate --play` at a device of the kernel. It takes the time of
// the first edge from the simulator's socket, and from then on gives an edge to the kernel's /dev/ppsN each whole
// second after it, by the module hueline_pps, until the simulator ends.
//
// The guest's processors are threads among others of the host, and stand still for milliseconds where it is busy. A
// pulse through an emulated interrupt would be stamped that late, which no receiver's is, and no clock would learn from
// it. So the time of the edge comes with it. An edge that comes too late for the driver to believe it is left out.
namespace {

using hueline::HostTime;
using hueline::nanoseconds;
using hueline::drivers::host_now;

// The driver reads its clocks ten times a second, and refuses an edge from before the last reading.
constexpr nanoseconds kLatest = std::chrono::milliseconds(50);

/// Returns the time of the first edge on the socket, if there is one.
std::optional<HostTime> first_edge(int simulator) {
  std::array<std::byte, 24> message{};
  if (::recv(simulator, message.data(), message.size(), 0) != static_cast<ssize_t>(message.size())) return {};
  std::int64_t edge = 0;
  std::memcpy(&edge, message.data() + 16, sizeof edge);
  return HostTime(nanoseconds(edge));
}

/// Returns whether the simulator is still there. Takes the edges that it has sent since.
bool is_there(int simulator) {
  std::array<std::byte, 24> message{};
  ssize_t size = 0;
  do size = ::recv(simulator, message.data(), message.size(), MSG_DONTWAIT);
  while (size > 0);
  return size < 0;
}

bool give(int device, HostTime edge) {
  const auto clocks = hueline::drivers::sample_clock_offset(hueline::drivers::KernelClock::Realtime);
  const std::int64_t stamp = (edge.time_since_epoch() - clocks.offset).count();
  return ::write(device, &stamp, sizeof stamp) == static_cast<ssize_t>(sizeof stamp);
}

}  // namespace

int main(int argc, char** argv) {
  sockaddr_un address{};
  if (argc != 2 || std::strlen(argv[1]) >= sizeof address.sun_path) return 2;
  const int device = ::open("/dev/hueline_pps", O_WRONLY);
  const sched_param priority{.sched_priority = 50};
  if (device < 0 || ::sched_setscheduler(0, SCHED_FIFO, &priority) != 0) {
    std::perror("vm_pulses");
    return 1;
  }
  address.sun_family = AF_UNIX;
  std::strcpy(address.sun_path, argv[1]);
  const int simulator = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
  while (::connect(simulator, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) ::usleep(50'000);
  const auto first = first_edge(simulator);
  if (!first) return 1;
  int given = 0, left_out = 0;
  nanoseconds largest{0};
  for (HostTime edge = *first + std::chrono::seconds(1); is_there(simulator); edge += std::chrono::seconds(1)) {
    std::this_thread::sleep_for(edge - host_now());
    const nanoseconds late = host_now() - edge;
    largest = std::max(largest, late);
    ++(late <= kLatest && give(device, edge) ? given : left_out);
  }
  std::printf("%d pulses given, %d left out; the latest was late by %.1f ms\n", given, left_out,
              static_cast<double>(largest.count()) * 1e-6);
  return 0;
}
