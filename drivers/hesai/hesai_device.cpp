#include "drivers/hesai/hesai_device.hpp"

#include "drivers/hesai/hesai_decoder.hpp"
#include "drivers/hesai/hesai_listener.hpp"
#include "drivers/transport/datagram_device.hpp"

namespace hueline::drivers {

// A packet spans 0.06 to 0.7 ms. An OT128 sends 36000 packets a second.
constinit const DeviceType kHesai{
    .word = "hesai",
    .role = Role::Laser,
    .is_sheddable = true,
    .make = make_device<DatagramDevice<HesaiDecoder>>,
    .laser = {.latency_min = std::chrono::microseconds(100), .pending_limit = 65536},
    .files = {.capture = {.kind = "a Hesai", .has_signature = true, .listen = listen_for_hesai}}};

}  // namespace hueline::drivers
