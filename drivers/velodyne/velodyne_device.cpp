#include "drivers/velodyne/velodyne_device.hpp"

#include "drivers/transport/datagram_device.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"
#include "drivers/velodyne/velodyne_listener.hpp"

namespace hueline::drivers {

constinit const DeviceType kVelodyne{
    .word = "velodyne",
    .role = Role::Laser,
    .is_sheddable = true,
    .make = make_device<DatagramDevice<VelodyneDecoder>>,
    .files = {.capture = {.kind = "a Velodyne", .has_signature = false, .listen = listen_for_velodyne}}};

}  // namespace hueline::drivers
