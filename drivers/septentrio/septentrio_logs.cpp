#include "drivers/septentrio/septentrio_logs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace hueline::drivers {
namespace {

constexpr std::array kPeriods{10, 20, 40, 50, 100, 200, 500, 1000, 2000, 5000, 10000};

std::string period_word(int ms) { return ms < 1000 ? fmt::format("msec{}", ms) : fmt::format("sec{}", ms / 1000); }

}  // namespace

void SeptentrioLogs::visit(Keys& keys) {
  static const TextForm form{"a name such as COM1, USB1 or IPS1",
                             [](const std::string& text) {
                               return !text.empty() && text.size() <= 8 && std::ranges::all_of(text, [](char c) {
                                 return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
                               });
                             },
                             "^[A-Z0-9]{1,8}$"};
  keys.text(required("connection", "",
                     "The receiver's own name of the connection that the blocks are sent on: COM1, USB1; for TCP a "
                     "server such as IPS1 that is set up in the receiver, because the number of a command connection "
                     "changes."),
            connection, form);
  keys.whole({"period_ms", "ms", "The period of INSNavGeod, the trajectory."}, period_ms, {0, 10000});
  keys.whole({"position_period_ms", "ms", "The period of PVTGeodetic, PosCovGeodetic and ReceiverTime."},
             position_period_ms, {0, 10000});
  keys.whole({"raw_period_ms", "ms", "The period of MeasEpoch and the navigation pages, for post-processing."},
             raw_period_ms, {0, 10000});
  keys.flag({"event_marks", "", "Whether ExtEvent is asked for: the edges at the event inputs."}, event_marks);
}

KeyError SeptentrioLogs::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  for (const auto& [key, ms] : {std::pair("period_ms", period_ms), std::pair("position_period_ms", position_period_ms),
                                std::pair("raw_period_ms", raw_period_ms)})
    if (ms != 0 && std::ranges::find(kPeriods, ms) == kPeriods.end())
      return not_allowed(key, std::to_string(ms),
                         "0 (not asked for), 10, 20, 40, 50, 100, 200, 500, 1000, 2000, 5000, 10000");
  return {};
}

std::string SeptentrioLogs::dialogue() const {
  std::string out;
  int stream = 1;
  const auto ask = [&](const char* blocks, const std::string& period) {
    out += fmt::format("setSBFOutput, Stream{}, {}, {}, {}\r\n", stream++, connection, blocks, period);
  };
  if (period_ms > 0) ask("INSNavGeod", period_word(period_ms));
  if (position_period_ms > 0) ask("PVTGeodetic+PosCovGeodetic+ReceiverTime", period_word(position_period_ms));
  if (raw_period_ms > 0) ask("MeasEpoch+RawNavBits", period_word(raw_period_ms));
  if (event_marks) ask("ExtEvent", "OnChange");
  return out;
}

}  // namespace hueline::drivers
