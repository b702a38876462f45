#include "drivers/ublox/ublox_device.hpp"

#include <string_view>

#include "drivers/stream/recognise.hpp"
#include "drivers/stream/stream_device.hpp"
#include "drivers/ublox/ublox_decoder.hpp"
#include "drivers/ublox/ublox_logs.hpp"
#include "drivers/ublox/ubx_form.hpp"

namespace hueline::drivers {
namespace {

struct UbloxTraits {
  static constexpr const char* kLog = "A log of the receiver (UBX, NMEA, RTCM 3).";
  static constexpr bool kHasDatagrams = false;
  using Logs = UbloxLogs;
};

bool is_ubx_log(std::string_view first_bytes) { return has_message<UbxForm>(first_bytes); }

}  // namespace

constinit const DeviceType kUblox{
    .word = "ublox",
    .role = Role::Pos,
    .is_sheddable = false,
    .make = make_device<StreamDevice<UbloxDecoder, UbloxTraits>>,
    .files = {.log = {.format = "u-blox UBX", .ending = ".ubx", .is_beginning = is_ubx_log}},
    .solutions =
        "NAV-PVAT, or NAV-PVT with NAV-ATT, or HNR-PVT with HNR-ATT, while the receiver fuses its inertial sensors"};

}  // namespace hueline::drivers
