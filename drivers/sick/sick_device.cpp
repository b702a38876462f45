#include "drivers/sick/sick_device.hpp"

#include <string_view>

#include "drivers/sick/cola_form.hpp"
#include "drivers/sick/sick_decoder.hpp"
#include "drivers/stream/recognise.hpp"
#include "drivers/stream/stream_device.hpp"

namespace hueline::drivers {
namespace {

struct SickTraits {
  static constexpr const char* kLog = "The bytes of a connection to the scanner (CoLa telegrams).";
  static constexpr bool kHasDatagrams = false;
  using Logs = SickOutput;
};

bool is_cola_log(std::string_view first_bytes) {
  return has_message<ColaBForm>(first_bytes) || has_message<ColaAForm>(first_bytes);
}

}  // namespace

// A scan is sent when the mirror has passed its last angle: 5 ms after the first firing at the highest frequency.
constinit const DeviceType kSick{
    .word = "sick",
    .role = Role::Laser,
    .is_sheddable = false,
    .make = make_device<StreamDevice<SickDecoder, SickTraits>>,
    .laser = {.latency_min = std::chrono::milliseconds(5), .pending_limit = 8192},
    .files = {.log = {.format = "SICK CoLa", .ending = ".cola", .is_beginning = is_cola_log}}};

}  // namespace hueline::drivers
