#include "drivers/transport/can_input.hpp"

namespace hueline::drivers {

void CanInput::visit(Keys& keys) {
  keys.section({"can", "",
                "The bus by SocketCAN, which listens only. Set the interface up first: `ip link set can0 up type can "
                "bitrate 500000 restart-ms 100`."},
               can);
  keys.section(
      {"cannelloni", "",
       "Datagrams of a CAN-to-Ethernet gateway that speaks "
       "[cannelloni](https://github.com/mguentner/cannelloni), usually on port 20000. It may gather frames "
       "before it sends them (its option `-t`): a wheel encoder's `stamp_delay_us` and `stamp_sigma_us` have to "
       "say so."},
      cannelloni);
  keys.section({"can_log", "", "A log of the bus."}, log);
}

std::unique_ptr<PacketSource> CanInput::make(const BufferPool& pool) const {
  if (log) return std::make_unique<CanLogSource>(*log);
  if (cannelloni) return std::make_unique<UdpSource>(*cannelloni, pool);
  return std::make_unique<CanSource>(can.value(), pool);
}

}  // namespace hueline::drivers
