#include "drivers/velodyne/velodyne_device.hpp"

#include "drivers/transport/datagram_device.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"

namespace hueline::drivers {

constinit const DeviceType kVelodyne{"velodyne", Role::Laser, true, make_device<DatagramDevice<VelodyneDecoder>>};

}  // namespace hueline::drivers
