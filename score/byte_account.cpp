#include "score/byte_account.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hueline::score {

std::uint64_t unexplained_bytes(const DeviceBytes& d) {
  const std::uint64_t counted = d.decoded + d.ignored + d.malformed;
  const std::uint64_t received = counted > d.received_bytes ? counted - d.received_bytes : d.received_bytes - counted;
  if (d.sent_units <= d.received_units) return received;
  const std::uint64_t missing = d.sent_units - d.received_units;
  const std::uint64_t untold = missing > d.told_lost ? missing - d.told_lost : 0;
  return received + static_cast<std::uint64_t>(std::llround(static_cast<double>(untold) * static_cast<double>(d.sent_bytes) / static_cast<double>(d.sent_units)));
}

void add_byte_figures(const std::map<std::string, DeviceBytes>& devices, ScenarioScore& score) {
  std::uint64_t sum = 0;
  for (const auto& [name, d] : devices) {
    const std::uint64_t unexplained = unexplained_bytes(d);
    sum += unexplained;
    score.notes.push_back(fmt::format("{}: {} bytes in {} packets received of {} sent; decoded {}, ignored by name {}, malformed {}, told lost {} units; unexplained {} bytes",
                                      name, d.received_bytes, d.received_units, d.sent_units, d.decoded, d.ignored, d.malformed, d.told_lost, unexplained));
  }
  score.figures["unexplained_bytes"] = devices.empty() ? Figure{{}, "no device sent anything"} : Figure{static_cast<double>(sum), {}};
}

}  // namespace hueline::score
