#include "drivers/gige/genicam_guest.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <cstring>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "drivers/gige/aravis_camera.hpp"
#include "drivers/gige/aravis_source.hpp"
#include "drivers/gige/gvsp_filter.hpp"
#include "drivers/usb3_vision/u3v_source.hpp"

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

/// A camera on whichever transport it is. It may have been plugged into another port since it was opened last.
class GenicamSource final : public PacketSource {
 public:
  GenicamSource(GenicamConfig config, AravisSurroundings surroundings)
      : config_(std::move(config)), surroundings_(std::move(surroundings)) {}

  Status open() override {
    source_.reset();
    if (std::string serial = serial_on_usb(); !serial.empty()) return open_on_usb(std::move(serial));
    auto on_ethernet = std::make_shared<AravisSource>(config_, surroundings_);
    std::packaged_task<Status()> search([on_ethernet] { return on_ethernet->open(); });
    std::future<Status> found = search.get_future();
    // Aravis waits a second for answers. A camera that comes to USB meanwhile is opened at once, and nobody waits for
    // the search any more.
    std::thread(std::move(search)).detach();
    constexpr std::chrono::milliseconds kLookAgain{50};
    while (found.wait_for(kLookAgain) != std::future_status::ready)
      if (config_.id.empty())
        if (std::string serial = serial_on_usb(); !serial.empty()) return open_on_usb(std::move(serial));
    source_ = std::move(on_ethernet);
    return found.get();
  }
  Result<Packet> next(std::stop_token stop) override {
    if (!source_) return Error{ErrorCode::Disconnected, "camera: not open"};
    return source_->next(stop);
  }
  void close() override {
    if (source_) source_->close();
  }

 private:
  /// Ethernet is searched only for a camera that is not on USB, because that takes a second.
  std::string serial_on_usb() const {
    if (!config_.address.empty()) return {};
    if (!config_.id.empty()) return usb3_serial_of(config_.id);
    return is_u3v_on_usb(config_.serial) ? config_.serial : std::string();
  }
  Status open_on_usb(std::string serial) {
    source_ = std::make_shared<U3vSource>(config_, std::move(serial), surroundings_.memory);
    return source_->open();
  }

  const GenicamConfig config_;
  const AravisSurroundings surroundings_;
  std::shared_ptr<PacketSource> source_;
};

}  // namespace

Result<std::unique_ptr<PacketSource>> make_genicam_guest(guest::HostLink& link) {
  const auto config = GenicamConfig::from_text(link.config().text);
  if (!config) return config.error();
  if (std::string problem = config->validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  AravisSurroundings surroundings;
  surroundings.memory = link.memory();
  surroundings.on_control = [&link](ArvDevice& device) {
    if (auto will = last_will(device)) link.send(*will);
  };
  return std::unique_ptr<PacketSource>(std::make_unique<GenicamSource>(*config, std::move(surroundings)));
}

}  // namespace hueline::drivers
