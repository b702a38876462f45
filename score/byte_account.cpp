#include "score/byte_account.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hueline::score {

std::uint64_t unexplained_bytes(const DeviceBytes& d) {
  const std::uint64_t counted = d.decoded + d.ignored + d.malformed;
  const std::uint64_t received = counted > d.received_bytes ? counted - d.received_bytes : d.received_bytes - counted;
  const std::uint64_t untold = d.missing_units > d.told_lost ? d.missing_units - d.told_lost : 0;
  if (untold == 0) return received;
  return received +
         static_cast<std::uint64_t>(std::llround(static_cast<double>(untold) * static_cast<double>(d.sent_bytes) /
                                                 static_cast<double>(d.sent_units)));
}

void add_byte_figures(const std::map<std::string, DeviceBytes>& devices, ScenarioScore& score) {
  std::uint64_t sum = 0, overtold = 0;
  for (const auto& [name, d] : devices) {
    const std::uint64_t unexplained = unexplained_bytes(d);
    sum += unexplained;
    overtold += d.told_lost > d.missing_units ? d.told_lost - d.missing_units : 0;
    score.notes.push_back(
        fmt::format("{}: {} units sent, {} of them never came, {} told lost; {} bytes came: decoded {}, ignored by "
                    "name {}, malformed {}; unexplained {}",
                    name, d.sent_units, d.missing_units, d.told_lost, d.received_bytes, d.decoded, d.ignored,
                    d.malformed, unexplained));
  }
  score.figures["unexplained_bytes"] =
      devices.empty() ? Figure{{}, "no device sent anything"} : Figure{static_cast<double>(sum), {}};
  score.figures["overtold_units"] =
      devices.empty() ? Figure{{}, "no device sent anything"} : Figure{static_cast<double>(overtold), {}};
}

}  // namespace hueline::score
