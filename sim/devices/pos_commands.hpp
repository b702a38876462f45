#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/wire/novatel_encode.hpp"

namespace hueline::sim {

/// What one client of a NovAtel receiver asked for: LOG, UNLOG, UNLOGALL (OEM7 manual, 2.76 and following).
/// Thread-bound.
class PosSubscriptions {
 public:
  /// Executes one abbreviated ASCII command and returns what the receiver answers. Logs are given in binary only
  /// (suffix B); other commands of a receiver's set-up are acknowledged and have no effect here.
  std::string execute(std::string_view line);

  /// True if this log is to be sent now. ONTIME thins: one log a period of GPS time. ONCE is used up.
  bool wants(const NovatelPeek& peek);

  bool empty() const { return wishes_.empty(); }

 private:
  struct Wish {
    std::uint16_t id = 0;
    std::uint32_t period_ms = 0;  ///< 0: every one
    bool is_once = false;
    std::optional<std::uint32_t> last_period;  ///< number of the period that was served last
  };
  std::string add(const std::vector<std::string>& words);
  std::string remove(const std::vector<std::string>& words);

  std::vector<Wish> wishes_;
};

}  // namespace hueline::sim
