#include "sim/sight_file.hpp"

#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>
#include <vector>

#include "sim/byte_file.hpp"
#include "sim/truth_file.hpp"

namespace hueline::sim {
namespace {

struct Packet {
  std::vector<TrueReturn> returns;
  std::uint32_t first_exposure = 0;
  std::vector<std::uint16_t> seen;
};

/// Returns the first of the `count` consecutive exposures that are nearest to `t`. `middles` is sorted by time and has
/// at least `count` elements.
std::uint32_t first_of_nearest(const std::vector<GpsNs>& middles, GpsNs t, std::uint32_t count) {
  std::size_t first = 0;
  while (first + count < middles.size() && middles[first + count] - t < t - middles[first]) ++first;
  return static_cast<std::uint32_t>(first);
}

}  // namespace

Status write_sights(const Scenario& scenario, const Drive& drive, const std::string& path, const Progress& progress,
                    const GenerateOptions& options) {
  auto truth = TruthReader::open(drive.cache_dir + "/truth.bin");
  if (!truth.ok()) return truth.error();
  const Motion motion(scenario);
  const World world(scenario, motion);
  const Visibility visibility(scenario, motion, world, truth->header().exposures);
  std::vector<GpsNs> middles;
  for (const TrueExposure& e : truth->header().exposures) middles.push_back(e.exposure_mid_gps_ns);
  const std::uint32_t asked = std::min(kSightExposures, static_cast<std::uint32_t>(middles.size()));
  const std::size_t lenses = rig_truth(scenario).lenses.size();

  const auto look = [&](Packet& packet) {
    packet.seen.assign(packet.returns.size(), 0);
    packet.first_exposure =
        packet.returns.empty() ? 0 : first_of_nearest(middles, packet.returns.front().fired_gps_ns, asked);
    for (std::size_t i = 0; i < packet.returns.size(); ++i)
      for (std::uint32_t k = 0; k < asked; ++k)
        for (std::size_t lens = 0; lens < lenses; ++lens)
          if (visibility.is_visible(packet.returns[i], lens, packet.first_exposure + k)) {
            packet.seen[i] = static_cast<std::uint16_t>(packet.seen[i] | 1u << k);
            break;
          }
  };

  ByteWriter out(path);
  out.bytes(kSightMagic, 8);
  out.number(static_cast<std::uint32_t>(middles.size()));
  out.number(asked);  // K and the three zero bytes
  const unsigned threads = options.threads > 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  std::vector<Packet> group(256);
  for (bool more = true; more;) {
    std::size_t count = 0;
    for (; count < group.size(); ++count) {
      auto returns = truth->next_packet();
      if (!returns.ok()) {
        if (returns.error().code != ErrorCode::EndOfData) return returns.error();
        more = false;
        break;
      }
      group[count].returns = std::move(*returns);
    }
    if (options.stop.stop_requested())
      return Error{ErrorCode::Stopped,
                   "stopped while finding which exposures saw which return; " + path + " is incomplete"};
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
      for (std::size_t i; (i = next.fetch_add(1)) < count;) look(group[i]);
    };
    {
      std::vector<std::jthread> others;
      for (unsigned t = 1; t < threads; ++t) others.emplace_back(work);
      work();
    }
    for (std::size_t i = 0; i < count; ++i) {
      out.number(group[i].first_exposure);
      out.number(static_cast<std::uint32_t>(group[i].seen.size()));
      out.bytes(group[i].seen.data(), group[i].seen.size() * sizeof(std::uint16_t));
    }
    if (progress && count > 0 && !group[count - 1].returns.empty())
      progress("finding which exposures saw which return",
               static_cast<double>(group[count - 1].returns.back().fired_gps_ns - drive.begin_gps_ns) /
                   static_cast<double>(drive.end_gps_ns - drive.begin_gps_ns));
  }
  return out.close();
}

}  // namespace hueline::sim
