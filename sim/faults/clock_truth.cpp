#include "sim/faults/clock_truth.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/output_file.hpp"
#include "sim/faults/stages.hpp"

namespace hueline::sim {
namespace {

constexpr std::int64_t kPeriodNs = 100'000'000;

/// Computes the rates from the offsets.
void add_rates(std::vector<ClockSample>& samples) {
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const ClockSample& before = samples[i - 1];
    samples[i].rate_ppb = 1e9 * static_cast<double>(samples[i].offset_ns - before.offset_ns) /
                          static_cast<double>(samples[i].gps_ns - before.gps_ns);
  }
  if (samples.size() > 1) samples[0].rate_ppb = samples[1].rate_ppb;
}

std::vector<ClockSample> camera_samples(const Timeline& timeline) {
  std::vector<ClockSample> out;
  for (const WireEvent& event : timeline.events)
    if (event.channel == WireChannel::Camera)
      out.push_back({VehicleClock::Camera, timeline.begin_gps_ns + event.latched_ns,
                     event.camera_counter_ns - event.latched_ns, 0});
  std::sort(out.begin(), out.end(), [](const ClockSample& a, const ClockSample& b) { return a.gps_ns < b.gps_ns; });
  // The counter was latched once for an image that is delivered twice.
  out.erase(std::unique(out.begin(), out.end(),
                        [](const ClockSample& a, const ClockSample& b) { return a.gps_ns == b.gps_ns; }),
            out.end());
  return out;
}

}  // namespace

const char* name(VehicleClock clock) {
  switch (clock) {
    case VehicleClock::Scanner:
      return "scanner";
    case VehicleClock::Receiver:
      return "receiver";
    case VehicleClock::Camera:
      return "camera";
    case VehicleClock::Host:
      return "host";
  }
  return "?";
}

std::vector<ClockSample> true_clocks(const Timeline& timeline, const std::vector<FaultLine>& lines) {
  const LineErrors errors(lines, timeline.begin_gps_ns);
  std::vector<ClockSample> of[4];
  for (std::int64_t t = 0; t < timeline.end_ns; t += kPeriodNs) {
    const GpsNs gps = timeline.begin_gps_ns + t;
    std::int64_t host = t;
    for (const FaultLine& line : lines) host += host_clock_error_ns(line, host);
    of[0].push_back({VehicleClock::Scanner, gps, errors.scanner_clock_ns(gps), 0});
    of[1].push_back({VehicleClock::Receiver, gps, errors.receiver_clock_ns(gps), 0});
    of[3].push_back({VehicleClock::Host, gps, host - t, 0});
  }
  of[2] = camera_samples(timeline);
  std::vector<ClockSample> out;
  for (auto& samples : of) {
    add_rates(samples);
    out.insert(out.end(), samples.begin(), samples.end());
  }
  return out;
}

Status write_clocks(const std::string& path, const std::vector<ClockSample>& samples) {
  std::string text = "clock,gps_ns,offset_ns,rate_ppb\n";
  for (const ClockSample& s : samples)
    text += fmt::format("{},{},{},{:.3f}\n", name(s.clock), s.gps_ns, s.offset_ns, s.rate_ppb);
  return write_output(path, text);
}

}  // namespace hueline::sim
