#include "drivers/nmea/nmea_device.hpp"

#include <string_view>

#include "drivers/nmea/nmea_decoder.hpp"
#include "drivers/stream/recognise.hpp"
#include "drivers/stream/stream_device.hpp"

namespace hueline::drivers {
namespace {

struct NmeaTraits {
  static constexpr const char* kLog = "A log of NMEA 0183 sentences.";
  static constexpr bool kHasDatagrams = true;
  using Logs = void;
};

bool is_nmea_log(std::string_view first_bytes) { return has_message<NmeaForm>(first_bytes); }

}  // namespace

constinit const DeviceType kNmea{
    .word = "nmea",
    .role = Role::Pos,
    .is_sheddable = false,
    .make = make_device<StreamDevice<NmeaDecoder, NmeaTraits>>,
    .files = {.log = {.format = "NMEA 0183", .ending = ".nmea", .is_beginning = is_nmea_log}},
    .solutions = "PASHR with roll, pitch and heading, together with GGA"};

}  // namespace hueline::drivers
