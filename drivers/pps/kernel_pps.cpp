#include "drivers/pps/kernel_pps.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/pps.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace hueline::drivers {

namespace {

constexpr nanoseconds kWaitForPulse = std::chrono::milliseconds(100);

// The host time is read last, so everything that was stamped before this call is older than it.
ClockReading read_clocks() {
  const ClockOffset offset = sample_clock_offset(KernelClock::Realtime);
  return {host_now(), offset};
}

}  // namespace

Status KernelPps::capture() const {
  const int edge = edge_ == PpsEdgeKind::Assert ? PPS_CAPTUREASSERT : PPS_CAPTURECLEAR;
  int capabilities = 0;
  if (::ioctl(fd_, PPS_GETCAP, &capabilities) != 0) return io_error("PPS_GETCAP on " + path_, errno);
  if ((capabilities & edge) == 0)
    return Error{ErrorCode::Unsupported,
                 fmt::format("{} does not capture the {} edge; configure the other one", path_, name(edge_))};
  if ((capabilities & PPS_CANWAIT) == 0)
    return Error{ErrorCode::Unsupported, fmt::format("{} cannot wait for an edge", path_)};
  pps_kparams params{};
  if (::ioctl(fd_, PPS_GETPARAMS, &params) != 0) return io_error("PPS_GETPARAMS on " + path_, errno);
  const pps_ktime& shift = edge_ == PpsEdgeKind::Assert ? params.assert_off_tu : params.clear_off_tu;
  if ((params.mode & edge) != 0 && shift.sec == 0 && shift.nsec == 0) return {};
  // Capture of this edge is added to what is set, because another program may read the other edge. An offset that
  // somebody left behind is removed.
  params.api_version = PPS_API_VERS;
  params.mode |= edge | PPS_TSFMT_TSPEC;
  params.assert_off_tu = params.clear_off_tu = {};
  if (::ioctl(fd_, PPS_SETPARAMS, &params) != 0)
    return io_error(fmt::format("PPS_SETPARAMS on {} for the {} edge (needs CAP_SYS_TIME)", path_, name(edge_)), errno);
  return {};
}

Status KernelPps::open() {
  close();
  fd_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd_ < 0) {
    const int error = errno;
    return Error{ErrorCode::Unavailable, fmt::format("open {}: {}", path_, std::strerror(error))};
  }
  Status ready = capture();
  if (ready) {
    const auto seen = fetch(nanoseconds(0));
    if (!seen)
      ready = seen.error();
    else {
      last_sequence_ = seen->sequence;
      sequence_ = seen->sequence;
      last_look_ = read_clocks();
    }
  }
  if (!ready) close();
  return ready;
}

Result<KernelPps::Seen> KernelPps::fetch(nanoseconds wait) const {
  pps_fdata data{};
  data.timeout.sec = wait.count() / 1'000'000'000;
  data.timeout.nsec = static_cast<std::int32_t>(wait.count() % 1'000'000'000);
  if (::ioctl(fd_, PPS_FETCH, &data) != 0) {
    const int error = errno;
    if (error == ETIMEDOUT || error == EINTR) return Error{ErrorCode::TimedOut, {}};
    return Error{ErrorCode::Disconnected, fmt::format("PPS_FETCH on {}: {}", path_, std::strerror(error))};
  }
  const bool is_assert = edge_ == PpsEdgeKind::Assert;
  const pps_ktime& time = is_assert ? data.info.assert_tu : data.info.clear_tu;
  return Seen{is_assert ? data.info.assert_sequence : data.info.clear_sequence,
              nanoseconds(time.sec * 1'000'000'000 + time.nsec)};
}

Result<Packet> KernelPps::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (held_) return *std::exchange(held_, std::nullopt);
  if (fd_ < 0) return Error{ErrorCode::Disconnected, fmt::format("{} is not open", path_)};
  // PPS_FETCH waits only for edges after the call. To see an edge that came since the last call, the device is asked
  // without waiting, once before and once after the wait. The clocks are read before the device, so that an edge
  // between the two belongs to the next call.
  ClockReading look = read_clocks();
  auto seen = fetch(nanoseconds(0));
  if (seen && seen->sequence == last_sequence_) {
    last_look_ = look;
    if (auto waited = fetch(kWaitForPulse); !waited && waited.error().code != ErrorCode::TimedOut)
      seen = waited.error();
    else {
      look = read_clocks();
      seen = fetch(nanoseconds(0));
    }
  }
  if (!seen) {
    if (seen.error().code != ErrorCode::TimedOut) close();
    return seen.error();
  }
  return deliver(*seen, look);
}

Result<Packet> KernelPps::deliver(const Seen& seen, const ClockReading& look) {
  const bool is_new = seen.sequence != last_sequence_;
  // The clocks are read after the device, so that the edge is older than the reading.
  const ClockReading now = is_new ? read_clocks() : look;
  const ClockReading before = std::exchange(last_look_, look);
  const auto step = step_between(before, now);
  if (!is_new) {
    if (step)
      return fault(now, 1,
                   fmt::format("CLOCK_REALTIME was set by {:+.6f} s; PPS edges do not follow it", to_seconds(*step)));
    if (is_gone()) {
      close();
      return Error{ErrorCode::Disconnected, fmt::format("{} is gone", path_)};
    }
    return Error{ErrorCode::TimedOut, {}};
  }
  // The kernel counts in 32 bits. The unsigned difference is right when its counter wraps.
  sequence_ += static_cast<std::uint32_t>(seen.sequence - last_sequence_);
  last_sequence_ = seen.sequence;
  const auto edge = place_edge(seen.stamp, before, now);
  if (!edge)
    return fault(now, 1,
                 fmt::format("{}: {} edge {} refused, CLOCK_REALTIME was set near it ({:+.6f} s)", path_, name(edge_),
                             sequence_, to_seconds(step.value_or(nanoseconds(0)))));
  const auto bytes = encode_pps({edge_, sequence_, *edge});
  Packet packet{kSystemSensor, PacketKind::Wire, false, 0, *edge, Buffer::copy_of(bytes)};
  if (!step) return packet;
  held_ = std::move(packet);
  return fault(now, 1,
               fmt::format("CLOCK_REALTIME was set by {:+.6f} s; PPS edges do not follow it", to_seconds(*step)));
}

Packet KernelPps::fault(const ClockReading& now, std::uint64_t count, std::string detail) const {
  return fault_packet(now.at, FaultKind::ClockStep, count, std::move(detail));
}

// An open file outlives its device and is merely silent. So the node shows whether the device is gone: it is missing,
// or it is another one.
bool KernelPps::is_gone() const {
  struct stat node {
  }, opened{};
  return ::stat(path_.c_str(), &node) != 0 || ::fstat(fd_, &opened) != 0 || node.st_dev != opened.st_dev ||
         node.st_ino != opened.st_ino;
}

void KernelPps::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  held_.reset();
}

}  // namespace hueline::drivers
