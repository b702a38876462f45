#include "drivers/profile_scanner/profile_scanner_device.hpp"

#include "drivers/profile_scanner/profile_scanner_decoder.hpp"
#include "drivers/transport/datagram_device.hpp"

namespace hueline::drivers {

// A datagram spans 0.05 to 1 ms, depending on the scanner's rate and the datagram's size. A fast scanner sends 18000
// datagrams a second.
constinit const DeviceType kProfileScanner{"profile_scanner",
                                           Role::Laser,
                                           true,
                                           make_device<DatagramDevice<ProfileScannerDecoder>>,
                                           {.latency_min = std::chrono::microseconds(500), .pending_limit = 65536}};

}  // namespace hueline::drivers
