#include <fmt/format.h>
#include <sys/socket.h>

#include <cstdio>

#include "drivers/gige/genicam_guest.hpp"
#include "drivers/guest/guest_process.hpp"
#include "drivers/guest/guest_side.hpp"
#include "drivers/ladybug/ladybug_usb_source.hpp"

/// hueline-guest: the process in which a library of another maker speaks to a device. The program starts one for each
/// such device.
int main() {
  using namespace hueline;
  using namespace hueline::drivers;
  int type = 0;
  socklen_t size = sizeof(type);
  if (::getsockopt(guest::kGuestSocket, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_SEQPACKET) {
    std::fputs("hueline-guest is started by hueline, once for each camera of a rig; do not start it yourself\n",
               stderr);
    return 2;
  }
  guest::serve(guest::kGuestSocket, [](guest::HostLink& link) -> Result<std::unique_ptr<PacketSource>> {
    if (link.config().driver == "genicam") return make_genicam_guest(link);
    if (link.config().driver == "ladybug") return make_ladybug_guest(link);
    return Error{ErrorCode::Unsupported,
                 fmt::format("driver '{}': this hueline-guest has none of that name; is it the program's own?",
                             link.config().driver)};
  });
}
