#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

/// Tests that unplug a device again and again.
namespace hueline::test {

/// Returns how often a test unplugs its device: as the environment's HUELINE_REPLUGS says, or `usually`.
inline int replugs(int usually) {
  const char* wanted = std::getenv("HUELINE_REPLUGS");
  return wanted ? std::atoi(wanted) : usually;
}

/// Says how long the first data took after the device was back, in each cycle.
inline void print_returns(const char* device, std::vector<double> took_s) {
  std::ranges::sort(took_s);
  if (!took_s.empty())
    std::printf("%s: %zu times unplugged; first data after its return within %.2f s (median), %.2f s (longest)\n",
                device, took_s.size(), took_s[took_s.size() / 2], took_s.back());
}

}  // namespace hueline::test
