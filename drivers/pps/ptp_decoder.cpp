#include "drivers/pps/ptp_decoder.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "core/calendar.hpp"
#include "drivers/pps/as_stamped.hpp"

namespace hueline::drivers {
namespace {

/// TAI at the beginning of GPS time, 1980-01-06T00:00:19, in seconds since 1970.
constexpr std::chrono::seconds kGpsBeginsInTai(315'964'819);
constexpr std::chrono::seconds kSetSince(1'577'836'800);  // 2020-01-01
// A clock that drifts by 100 ppm is 2 us off then.
constexpr nanoseconds kLongestAfterSecond = std::chrono::milliseconds(20);
constexpr nanoseconds kLongestHalfWindow = std::chrono::microseconds(50);

}  // namespace

void PtpDecoder::decode(const Packet& packet, std::vector<Measurement>& out) {
  const auto bytes = packet.bytes.bytes();
  const auto fault = [&](FaultKind kind, std::string detail) {
    out.push_back(Fault{packet.sensor, kind, packet.received, 1, std::move(detail)});
  };
  const auto reading = decode_ptp(bytes);
  if (!reading) {
    counts_.malformed_bytes += bytes.size();
    ++counts_.malformed_messages;
    return fault(FaultKind::Malformed, reading.error().message);
  }
  ++counts_.of("reading");
  const auto ignore = [&](FaultKind kind, std::string detail) {
    counts_.ignored_bytes += bytes.size();
    fault(kind, std::move(detail));
  };
  if (std::exchange(last_sequence_, reading->sequence) == reading->sequence)
    return ignore(FaultKind::Spurious, fmt::format("reading {} of the PTP clock came twice", reading->sequence));
  const auto second = std::chrono::floor<std::chrono::seconds>(reading->clock);
  if (second < kSetSince) {
    if (std::exchange(is_unset_, true))
      counts_.ignored_bytes += bytes.size();
    else
      ignore(FaultKind::NoTime,
             fmt::format("the PTP clock shows {} s since 1970: nobody has set it; does ptp4l run, and "
                         "has it a master with GNSS?",
                         second.count()));
    return;
  }
  is_unset_ = false;
  const nanoseconds after = reading->clock - second;
  if (after > kLongestAfterSecond)
    return ignore(FaultKind::Lost,
                  fmt::format("the PTP clock was read {:.0f} ms after its second: not used; the computer was too busy",
                              std::chrono::duration<double, std::milli>(after).count()));
  if (reading->half_window > kLongestHalfWindow)
    return ignore(
        FaultKind::Spurious,
        fmt::format("a reading of the PTP clock is uncertain by {:.0f} us: not used; the computer was too busy",
                    std::chrono::duration<double, std::micro>(reading->half_window).count()));
  // Ingest sets `received` to the arrival if the reading's own time is impossible.
  const double off_s = to_seconds(packet.received.time_since_epoch()) - to_seconds(reading->host.time_since_epoch());
  if (std::abs(off_s) > kReceivedAsStamped_s)
    return ignore(FaultKind::Spurious, "a reading of the PTP clock is stamped off its arrival: not used");
  counts_.decoded_bytes += bytes.size();
  out.push_back(PpsEdge{packet.sensor, reading->host - after, reading->sequence});
  const GpsTime named = scale_ == PtpScale::Tai ? GpsTime(second - kGpsBeginsInTai) : from_unix(UnixTime(second));
  out.push_back(TimeLabel{packet.sensor, packet.received, named, {}, true});
}

}  // namespace hueline::drivers
