#include "drivers/novatel/message_table.hpp"

#include <algorithm>
#include <array>

namespace hueline::drivers {
namespace {

using enum NovatelUse;
using enum NovatelStamp;

// Sorted by id. Source of ids and lengths: OEM7 Commands and Logs Reference Manual and SPAN logs. MARKTIME (231) is the
// older name of MARK1TIME (1130). The ids of MARK3PVA and MARK4PVA do not follow that of MARK2PVA.
constexpr std::array kMessages{
    NovatelMessageInfo{37, "VERSION", Ignored, 0, Any},
    NovatelMessageInfo{42, "BESTPOS", BestPos, 72, Regular},
    NovatelMessageInfo{93, "RXSTATUS", Ignored, 0, Any},
    NovatelMessageInfo{99, "BESTVEL", Ignored, 44, Regular},
    NovatelMessageInfo{101, "TIME", Time, 44, Regular},
    NovatelMessageInfo{231, "MARKTIME", MarkTime, 40, Moment, 1},
    NovatelMessageInfo{268, "RAWIMU", RawImu, 40, Regular},
    NovatelMessageInfo{325, "RAWIMUS", RawImu, 40, Regular},
    NovatelMessageInfo{507, "INSPVA", InsPva, 88, Regular},
    NovatelMessageInfo{508, "INSPVAS", InsPva, 88, Regular},
    NovatelMessageInfo{616, "MARK2TIME", MarkTime, 40, Moment, 2},
    NovatelMessageInfo{726, "BESTUTM", Ignored, 80, Regular},
    NovatelMessageInfo{812, "CORRIMUDATA", CorrImuData, 60, Regular},
    NovatelMessageInfo{813, "CORRIMUDATAS", CorrImuData, 60, Regular},
    NovatelMessageInfo{1067, "MARK1PVA", MarkPva, 88, Moment, 1},
    NovatelMessageInfo{1068, "MARK2PVA", MarkPva, 88, Moment, 2},
    NovatelMessageInfo{1075, "MARK3TIME", MarkTime, 40, Moment, 3},
    NovatelMessageInfo{1076, "MARK4TIME", MarkTime, 40, Moment, 4},
    NovatelMessageInfo{1118, "MARK3PVA", MarkPva, 88, Moment, 3},
    NovatelMessageInfo{1119, "MARK4PVA", MarkPva, 88, Moment, 4},
    NovatelMessageInfo{1130, "MARK1TIME", MarkTime, 40, Moment, 1},
    NovatelMessageInfo{1163, "PSRDOP2", Ignored, 0, Moment},
    NovatelMessageInfo{1335, "HEADING2", Ignored, 48, Moment},
    NovatelMessageInfo{1362, "IMURATECORRIMUS", ImuRateCorrImuS, 60, Regular},
    NovatelMessageInfo{1429, "BESTGNSSPOS", Ignored, 72, Regular},
    NovatelMessageInfo{1461, "RAWIMUX", RawImuX, 40, Regular},
    NovatelMessageInfo{1462, "RAWIMUSX", RawImuX, 40, Regular},
    NovatelMessageInfo{1465, "INSPVAX", InsPvaX, 126, Regular},
    NovatelMessageInfo{1945, "INSCONFIG", InsConfig, 0, Any},
    NovatelMessageInfo{2051, "INSSTDEV", InsStdev, 52, Regular},
    NovatelMessageInfo{2052, "INSSTDEVS", InsStdev, 52, Regular},
    NovatelMessageInfo{2264, "CORRIMUS", CorrImuS, 60, Regular},
};
static_assert(std::is_sorted(kMessages.begin(), kMessages.end(),
                             [](const auto& a, const auto& b) { return a.id < b.id; }));

constexpr std::size_t kMayBeAppended = 64;

}  // namespace

const NovatelMessageInfo* find_novatel_message(std::uint16_t id) {
  const auto found =
      std::lower_bound(kMessages.begin(), kMessages.end(), id,
                       [](const NovatelMessageInfo& info, std::uint16_t wanted) { return info.id < wanted; });
  return found != kMessages.end() && found->id == id ? &*found : nullptr;
}

bool is_plausible_length(std::uint16_t id, std::size_t body_bytes) {
  const NovatelMessageInfo* info = find_novatel_message(id);
  if (!info || info->body_bytes == 0) return true;
  return body_bytes >= info->body_bytes && body_bytes <= info->body_bytes + kMayBeAppended;
}

}  // namespace hueline::drivers
