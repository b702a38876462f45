#include <array>

#include "drivers/applanix/applanix_device.hpp"
#include "drivers/device.hpp"
#include "drivers/gige/genicam_device.hpp"
#include "drivers/hesai/hesai_device.hpp"
#include "drivers/ladybug/ladybug_device.hpp"
#include "drivers/livox/livox_device.hpp"
#include "drivers/nmea/nmea_device.hpp"
#include "drivers/novatel/novatel_device.hpp"
#include "drivers/ouster/ouster_device.hpp"
#include "drivers/oxts/oxts_device.hpp"
#include "drivers/pps/pps_device.hpp"
#include "drivers/profile_scanner/profile_scanner_device.hpp"
#include "drivers/robosense/robosense_device.hpp"
#include "drivers/ros_cloud/ros_cloud_device.hpp"
#include "drivers/sbet/sbet_device.hpp"
#include "drivers/septentrio/septentrio_device.hpp"
#include "drivers/sick/sick_device.hpp"
#include "drivers/ublox/ublox_device.hpp"
#include "drivers/v4l2/v4l2_device.hpp"
#include "drivers/velodyne/velodyne_device.hpp"
#include "drivers/wheel/wheel_device.hpp"
#include "drivers/xsens/xsens_device.hpp"

namespace hueline::drivers {

DeviceTypes device_types() {
  static constexpr std::array<const DeviceType*, 21> kTypes{
      &kVelodyne, &kHesai,   &kOuster,   &kLivox,      &kRobosense, &kProfileScanner, &kRosCloud,
      &kSick,     &kNovatel, &kApplanix, &kSeptentrio, &kUblox,     &kXsens,          &kOxts,
      &kGenicam,  &kV4l2,    &kLadybug,  &kPps,        &kWheel,     &kNmea,           &kSbet,
  };
  return kTypes;
}

}  // namespace hueline::drivers
