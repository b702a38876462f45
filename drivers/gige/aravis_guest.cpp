#include "drivers/gige/aravis_guest.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include "drivers/gige/aravis_camera.hpp"
#include "drivers/gige/aravis_source.hpp"
#include "drivers/gige/gvsp_filter.hpp"

namespace hueline::drivers {
namespace {

// A GVCP command that writes 0 into the control channel privilege register, so that the camera is free for the next
// controller. Its request number is the one that Aravis uses last: Aravis counts from 65300 and skips 0.
constexpr std::array<std::uint8_t, 16> kLetGo{0x42, 0x01, 0x00, 0x82, 0x00, 0x08, 0xFF, 0x00,
                                              0x00, 0x00, 0x0A, 0x00, 0x00, 0x00, 0x00, 0x00};

/// Returns the last will of a GigE camera. It has to be sent from the port that took control, because a camera accepts
/// commands only from that address and port.
std::optional<guest::LastWill> last_will(ArvDevice& device) {
  if (!ARV_IS_GV_DEVICE(&device)) return std::nullopt;
  auto* const camera = ARV_GV_DEVICE(&device);
  const sockaddr_in own = ipv4_of(arv_gv_device_get_interface_address(camera));
  const sockaddr_in peer = ipv4_of(arv_gv_device_get_device_address(camera));
  // At this moment the control channel is the only UDP socket that is bound to this address.
  const auto sockets = own_sockets(AF_INET, SOCK_DGRAM);
  for (const int fd : sockets) {
    const sockaddr_in bound = bound_address(fd);
    if (bound.sin_addr.s_addr != own.sin_addr.s_addr || bound.sin_port == 0) continue;
    guest::LastWill will;
    std::memcpy(will.from.data(), &bound.sin_addr, will.from.size());
    std::memcpy(will.to.data(), &peer.sin_addr, will.to.size());
    will.from_port = ntohs(bound.sin_port);
    will.to_port = ntohs(peer.sin_port);
    const auto bytes = std::as_bytes(std::span(kLetGo));
    will.datagram.assign(bytes.begin(), bytes.end());
    // Only the camera may send to this socket; without the filter any computer on the network could. Attaching it
    // cannot fail here.
    (void)attach_filter(fd, gvcp_filter(peer.sin_addr));
    return will;
  }
  return std::nullopt;
}

}  // namespace

Result<std::unique_ptr<PacketSource>> make_aravis_guest(guest::HostLink& link) {
  const auto config = GenicamConfig::from_text(link.config().text);
  if (!config) return config.error();
  if (std::string problem = config->validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  AravisSurroundings surroundings;
  surroundings.memory = link.memory();
  surroundings.on_control = [&link](ArvDevice& device) {
    if (auto will = last_will(device)) link.send(*will);
  };
  return std::unique_ptr<PacketSource>(std::make_unique<AravisSource>(*config, std::move(surroundings)));
}

}  // namespace hueline::drivers
