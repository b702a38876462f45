#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <new>
#include <thread>

#include "drivers/guest/guest_process.hpp"
#include "drivers/guest/guest_side.hpp"
#include "drivers/transport/host_clock.hpp"

// A guest that misbehaves as its settings say. It does what a library can do to its process, and sends what a broken or
// hostile guest can send.
namespace hueline::drivers {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kPacketBytes = 100'000;
constexpr int kGoodPackets = 5;

[[noreturn]] void hang() {
  for (;;) std::this_thread::sleep_for(1h);
}

void say(std::vector<std::byte> bytes) { ::send(guest::kGuestSocket, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
void say(const guest::ToHost& message) { say(guest::encode(message)); }

std::string rights() {
  std::string text;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("CapPrm") || line.starts_with("CapEff") || line.starts_with("CapBnd") ||
        line.starts_with("NoNewPrivs"))
      text += fmt::format("{} ", line);
  rlimit core{};
  ::getrlimit(RLIMIT_CORE, &core);
  text += fmt::format("core:{} files:", core.rlim_cur);
  for (const auto& file : std::filesystem::directory_iterator("/proc/self/fd"))
    if (std::error_code error; std::filesystem::exists(std::filesystem::symlink_status(file.path(), error)))
      text += fmt::format(" {}", file.path().filename().string());
  return text;
}

/// Sends packets filled with their number, until the library does what `mode` says.
class Library final : public PacketSource {
 public:
  Library(std::string mode, std::shared_ptr<PacketMemory> memory)
      : mode_(std::move(mode)), memory_(std::move(memory)) {}
  Status open() override {
    if (mode_ == "hangs in open") hang();
    if (mode_ == "dies in open") std::abort();
    if (mode_ == "refuses") return Error{ErrorCode::Invalid, "no such setting: \x1b[31m\xff\xfe\n"};
    if (mode_ == "tells its rights") return Error{ErrorCode::Unavailable, rights()};
    return memory_->prepare(mode_ == "has large packets"
                                ? 64u << 20
                                : kPacketBytes);  // 48 of them: 3 GB, of which pages come as they are used
  }
  Result<Packet> next(std::stop_token) override {
    if (number_ == kGoodPackets) misbehave();
    std::this_thread::sleep_for(2ms);
    MutableBuffer packet = memory_->acquire(kPacketBytes);
    if (!packet) return Error{ErrorCode::TimedOut, {}};
    std::memset(packet.data(), ++number_, packet.size());
    last_ = packet.data();
    return Packet{1, PacketKind::Wire, false, 0, host_now(), std::move(packet).share()};
  }
  void close() override {
    if (mode_ == "hangs in close") hang();
  }

 private:
  void misbehave() {
    if (mode_ == "aborts") {
      std::fputs("resource deadlock avoided\x1b[2J\n", stderr);
      std::abort();
    }
    if (mode_ == "reads nowhere") *const_cast<volatile int*>(static_cast<int*>(nullptr)) = 1;
    if (mode_ == "exits") ::_exit(7);
    if (mode_ == "exits well") ::_exit(0);
    if (mode_ == "hangs") hang();
    if (mode_ == "stops") std::raise(SIGSTOP);
    if (mode_ == "eats memory")
      for (;;) std::memset(::operator new(16u << 20), 1, 16u << 20);
    if (mode_ == "gives a slot twice")
      say(guest::Done{0, 100, host_now()}), say(guest::Done{0, 100, host_now()}), hang();
    if (mode_ == "gives no slot") say(guest::Done{4'000'000'000U, 100, host_now()}), hang();
    if (mode_ == "gives too much") say(guest::Done{1, std::uint64_t{1} << 40, host_now()}), hang();
    if (mode_ == "stamps the future") say(guest::Done{1, 100, host_now() + 1h}), hang();
    if (mode_ == "stamps the past") say(guest::Done{1, 100, HostTime{}}), hang();
    if (mode_ == "stamps a loss anyhow")
      say(guest::Loss{{1, FaultKind::Lost, HostTime(nanoseconds(-1)), 1, ""}}), hang();
    if (mode_ == "gives nothing") say(guest::Done{1, 0, host_now()}), hang();
    if (mode_ == "wants memory again") say(guest::NeedMemory{kPacketBytes}), hang();
    if (mode_ == "says nothing known") say(std::vector<std::byte>(50'000, std::byte{0xAB})), hang();
    if (mode_ == "says half") {
      auto half = guest::encode(guest::ToHost(guest::Done{}));
      half.resize(9);
      say(half), hang();
    }
    if (mode_ == "says an empty word") say(std::vector<std::byte>{}), hang();
    if (mode_ == "says it runs again") say(guest::Running{}), hang();
    if (mode_ == "tells of losses without end")
      for (;;) say(guest::Loss{{1, FaultKind::Lost, host_now(), 1, std::string(50'000, '\x1b')}});
    if (mode_ == "claims an end") say(guest::Failed{{ErrorCode::EndOfData, "all is well"}}), hang();
  }

  const std::string mode_;
  const std::shared_ptr<PacketMemory> memory_;
  int number_ = 0;
  std::byte* last_ = nullptr;
};

}  // namespace
}  // namespace hueline::drivers

int main() {
  using namespace hueline;
  using namespace hueline::drivers;
  guest::serve(guest::kGuestSocket, [](guest::HostLink& link) -> Result<std::unique_ptr<PacketSource>> {
    const std::string& mode = link.config().text;
    if (mode == "wants too much memory") say(guest::NeedMemory{~std::uint64_t{0}}), hang();
    if (mode == "wants no memory") say(guest::NeedMemory{0}), hang();
    if (mode == "gives before it has memory") say(guest::Done{0, 100, host_now()}), hang();
    return std::unique_ptr<PacketSource>(std::make_unique<Library>(mode, link.memory()));
  });
}
