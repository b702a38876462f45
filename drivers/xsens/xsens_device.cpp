#include "drivers/xsens/xsens_device.hpp"

#include <string_view>

#include "drivers/stream/recognise.hpp"
#include "drivers/stream/stream_device.hpp"
#include "drivers/xsens/xbus_form.hpp"
#include "drivers/xsens/xsens_can_decoder.hpp"
#include "drivers/xsens/xsens_decoder.hpp"

namespace hueline::drivers {
namespace {

struct XsensTraits {
  static constexpr const char* kLog = "A file of the device (Xbus messages with MTData2).";
  static constexpr bool kHasDatagrams = false;
  using Logs = void;
  using OnCan = XsensCanDecoder;
};

bool is_xsens_log(std::string_view first_bytes) { return has_message<XbusForm>(first_bytes); }

}  // namespace

constinit const DeviceType kXsens{
    .word = "xsens",
    .role = Role::Pos,
    .is_sheddable = false,
    .make = make_device<StreamDevice<XsensDecoder, XsensTraits>>,
    .files = {.log = {.format = "Xsens MTi", .ending = ".mtb", .is_beginning = is_xsens_log}},
    .solutions = "orientation, latitude and longitude, ellipsoidal altitude, velocity and UTC time in one packet"};

}  // namespace hueline::drivers
