#include "drivers/pps/ptp_clock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/ptp_clock.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {
namespace {

constexpr nanoseconds kWait = std::chrono::milliseconds(100);
constexpr nanoseconds kBehindSecond = std::chrono::microseconds(200);
constexpr unsigned kComparisons = 9;

nanoseconds ns_of(const ptp_clock_time& time) {
  return std::chrono::seconds(time.sec) + nanoseconds(static_cast<std::int64_t>(time.nsec));
}

std::int64_t second_of(nanoseconds clock) { return std::chrono::floor<std::chrono::seconds>(clock).count(); }

/// The computer's clock before and after a reading of the PTP clock.
struct Bracket {
  nanoseconds before{0}, clock{0}, after{0};
  nanoseconds window() const { return after - before; }
};

PtpPacket packet_of(const Bracket& shortest, const ClockOffset& realtime) {
  const nanoseconds half = shortest.window() / 2;
  return {half + realtime.half_window, 0, shortest.clock, to_host_time(shortest.before + half, realtime)};
}

}  // namespace

Status PtpClock::open() {
  close();
  FileDescriptor clock(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
  if (!clock) {
    const int error = errno;
    return Error{
        ErrorCode::Unavailable,
        fmt::format("open {}: {}{}", path_, std::strerror(error),
                    error == ENOENT   ? "; `ethtool -T INTERFACE` names the clock of a network card, if it has one"
                    : error == EACCES ? "; the package's rule /usr/lib/udev/rules.d/60-hueline.rules gives the right"
                                      : "")};
  }
  ptp_clock_caps capabilities{};
  if (::ioctl(clock.get(), PTP_CLOCK_GETCAPS, &capabilities) != 0)
    return Error{ErrorCode::Unsupported, fmt::format("{} is no PTP clock: {}", path_, std::strerror(errno))};
  clock_ = std::move(clock);
  how_ = capabilities.cross_timestamping ? Comparison::Precise : Comparison::Extended;
  awaited_.reset();
  sequence_ = 0;
  const auto first = compare();
  if (!first) {
    close();
    return first.error();
  }
  return {};
}

Result<PtpPacket> PtpClock::compare(Comparison how) const {
  const auto failed = [&](int error) {
    const bool is_gone = error == ENODEV || error == ENXIO;
    return Error{is_gone ? ErrorCode::Disconnected : ErrorCode::Unsupported,
                 fmt::format("read {}: {}", path_, is_gone ? "the clock is gone" : std::strerror(error))};
  };
  if (how == Comparison::Precise) {
    ptp_sys_offset_precise at_once{};
    if (::ioctl(clock_.get(), PTP_SYS_OFFSET_PRECISE, &at_once) != 0) return failed(errno);
    return PtpPacket{nanoseconds(0), 0, ns_of(at_once.device), HostTime(ns_of(at_once.sys_monoraw))};
  }
  Bracket shortest{nanoseconds(0), nanoseconds(0), nanoseconds::max()};
  const auto keep = [&](const ptp_clock_time& before, const ptp_clock_time& clock, const ptp_clock_time& after) {
    const Bracket one{ns_of(before), ns_of(clock), ns_of(after)};
    if (one.window() >= nanoseconds(0) && one.window() < shortest.window()) shortest = one;
  };
  if (how == Comparison::Extended) {
    ptp_sys_offset_extended several{};
    several.n_samples = kComparisons;
    if (::ioctl(clock_.get(), PTP_SYS_OFFSET_EXTENDED, &several) != 0) return failed(errno);
    for (unsigned i = 0; i < kComparisons; ++i) keep(several.ts[i][0], several.ts[i][1], several.ts[i][2]);
  } else {
    ptp_sys_offset several{};
    several.n_samples = kComparisons;
    if (::ioctl(clock_.get(), PTP_SYS_OFFSET, &several) != 0) return failed(errno);
    for (unsigned i = 0; i < kComparisons; ++i) keep(several.ts[2 * i], several.ts[2 * i + 1], several.ts[2 * i + 2]);
  }
  return packet_of(shortest, sample_clock_offset(KernelClock::Realtime));
}

/// Compares as well as the clock's driver can; what it cannot is not tried again.
Result<PtpPacket> PtpClock::compare() {
  for (;;) {
    auto made = compare(how_);
    if (made || made.error().code == ErrorCode::Disconnected || how_ == Comparison::Basic) return made;
    how_ = how_ == Comparison::Precise ? Comparison::Extended : Comparison::Basic;
  }
}

Result<Packet> PtpClock::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (!clock_) return Error{ErrorCode::Disconnected, path_ + " is not open"};
  const auto fail = [&](const Error& error) {
    close();
    return Error{ErrorCode::Disconnected, error.message};
  };
  auto now = compare();
  if (!now) return fail(now.error());
  const std::int64_t second = second_of(now->clock);
  // A clock that was set back is followed at once.
  if (!awaited_ || *awaited_ > second + 1) awaited_ = second + 1;
  if (second < *awaited_) {
    const nanoseconds left = std::chrono::seconds(*awaited_) + kBehindSecond - now->clock;
    std::this_thread::sleep_for(std::min(left, kWait));
    if (left > kWait) return Error{ErrorCode::TimedOut, {}};
    now = compare();
    if (!now) return fail(now.error());
    if (second_of(now->clock) < *awaited_) return Error{ErrorCode::TimedOut, {}};
  }
  awaited_ = second_of(now->clock) + 1;
  now->sequence = ++sequence_;
  return Packet{kSystemSensor, PacketKind::Wire, false, 0, now->host, Buffer::copy_of(encode_ptp(*now))};
}

}  // namespace hueline::drivers
