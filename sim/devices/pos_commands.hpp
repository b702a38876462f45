#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/wire/novatel_encode.hpp"

namespace hueline::sim {

/// The logs that one client of a NovAtel receiver asked for with LOG, UNLOG and UNLOGALL (OEM7 manual, 2.76 and
/// following). Thread safety: none.
class PosSubscriptions {
 public:
  /// Executes one abbreviated ASCII command and returns the receiver's answer. Only binary logs (suffix B) are
  /// accepted. Other commands of a receiver's configuration are acknowledged and have no effect.
  std::string execute(std::string_view line);

  /// Returns true if this log is to be sent now. ONTIME requests one log in each period of GPS time. A request with
  /// ONCE ends when it is served.
  bool wants(const NovatelPeek& peek);

  bool empty() const { return wishes_.empty(); }

 private:
  struct Wish {
    std::uint16_t id = 0;
    std::uint32_t period_ms = 0;  ///< 0: every log
    bool is_once = false;
    std::optional<std::uint32_t> last_period;  ///< number of the period that was served last
  };
  std::string add(const std::vector<std::string>& words);
  std::string remove(const std::vector<std::string>& words);

  std::vector<Wish> wishes_;
};

}  // namespace hueline::sim
