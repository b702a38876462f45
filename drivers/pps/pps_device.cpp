#include "drivers/pps/pps_device.hpp"

#include <memory>
#include <string>

#include <sys/un.h>

#include "drivers/pps/pps_decoder.hpp"
#include "drivers/pps/pps_source.hpp"

namespace hueline::drivers {
namespace {

class PpsDevice final : public Device {
 public:
  void visit(Keys& keys) override {
    static const TextForm absolute{"an absolute path", [](const std::string& text) { return text.starts_with('/'); },
                                   "^/"};
    static const TextForm short_path{
        "a path of at most 107 characters",
        [](const std::string& text) { return text.size() < sizeof(sockaddr_un::sun_path); }, "^.{1,107}$"};
    keys.one_of({"device", "socket"});
    keys.text({"device", "", "The kernel's PPS device, such as /dev/pps0."}, device_, absolute);
    keys.text({"socket", "",
               "Instead of a device, a local SOCK_SEQPACKET socket that sends the 24 bytes of [formats](formats.md). A "
               "relative path begins where the program was started."},
              socket_, short_path);
    keys.choice({"edge", "", "The edge that is the second. A level converter may invert it."}, edge_,
                {{"assert", PpsEdgeKind::Assert}, {"clear", PpsEdgeKind::Clear}});
  }
  KeyError validate() const override { return {}; }
  std::unique_ptr<PacketSource> make_source(const BufferPool&) const override {
    const bool is_socket = !socket_.empty();
    return std::make_unique<PpsSource>(
        PpsSource::Config{.interface = is_socket ? PpsSource::Interface::Socket : PpsSource::Interface::Kernel,
                          .path = is_socket ? socket_ : device_,
                          .edge = edge_});
  }
  std::unique_ptr<Decoder> make_decoder() const override {
    return std::make_unique<PpsDecoder>(PpsDecoder::Config{.edge = edge_});
  }

 private:
  std::string device_, socket_;
  PpsEdgeKind edge_ = PpsEdgeKind::Assert;
};

}  // namespace

constinit const DeviceType kPps{"pps", Role::Pps, false, make_device<PpsDevice>};

}  // namespace hueline::drivers
