#include "drivers/pps/pps_device.hpp"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <sys/un.h>

#include "drivers/pps/gpio_pps.hpp"
#include "drivers/pps/pps_decoder.hpp"
#include "drivers/pps/pps_source.hpp"
#include "drivers/pps/ptp_clock.hpp"
#include "drivers/pps/ptp_decoder.hpp"

namespace hueline::drivers {
namespace {

const TextForm kAbsolute{"an absolute path", [](const std::string& text) { return text.starts_with('/'); }, "^/"};

/// Keys of `gpio`.
struct GpioKeys : GpioLine {
  void visit(Keys& keys) {
    keys.text(required("chip", "", "The GPIO chip, such as /dev/gpiochip0."), chip, kAbsolute);
    keys.whole(required("line", "", "Number of the line in the chip, as gpioinfo prints it."), line, {0, 65535});
  }
};

/// Keys of `ptp`.
struct PtpKeys {
  std::string device;
  PtpScale scale = PtpScale::Tai;

  void visit(Keys& keys) {
    keys.text(required("device", "",
                       "The PTP clock, such as /dev/ptp0. `ethtool -T INTERFACE` names that of a network card."),
              device, kAbsolute);
    keys.choice(
        required("scale", "",
                 "What the clock counts: `tai` as PTP does and ptp4l sets it, or `utc`. A wrong one is 37 s off, and "
                 "the POS contradicts it."),
        scale, {{"tai", PtpScale::Tai}, {"utc", PtpScale::Utc}});
  }
};

class PpsDevice final : public PulseDevice {
 public:
  void visit(Keys& keys) override {
    static const TextForm short_path{
        "a path of at most 107 characters",
        [](const std::string& text) { return text.size() < sizeof(sockaddr_un::sun_path); }, "^.{1,107}$"};
    keys.one_of({"device", "socket", "serial", "gpio", "ptp"});
    keys.text({"device", "", "The kernel's PPS device, such as /dev/pps0."}, device_, kAbsolute);
    keys.text({"socket", "",
               "Instead of a device, a local SOCK_SEQPACKET socket that sends the 24 bytes of [formats](formats.md). A "
               "relative path begins where the program was started."},
              socket_, short_path);
    keys.text(
        {"serial", "",
         "Instead of a device, a serial port with the pulse at its carrier-detect input (DCD), such as /dev/ttyS0. "
         "The kernel's module pps_ldisc stamps it. The port serves nothing else meanwhile."},
        serial_, kAbsolute);
    keys.section({"gpio", "", "Instead of a device, a line of a GPIO chip. `assert` is its rising edge."}, gpio_);
    keys.section(
        {"ptp", "",
         "Instead of a device, a PTP hardware clock that ptp4l (linuxptp) sets: its seconds are the pulses, and "
         "it names them."},
        ptp_);
    keys.choice({"edge", "", "The edge that is the second. A level converter may invert it."}, edge_,
                {{"assert", PpsEdgeKind::Assert}, {"clear", PpsEdgeKind::Clear}});
  }
  KeyError validate() const override { return {}; }
  bool names_seconds() const override { return ptp_.has_value(); }
  std::unique_ptr<PacketSource> make_source(const BufferPool&) const override {
    if (ptp_) return std::make_unique<PtpClock>(ptp_->device);
    using Interface = PpsSource::Interface;
    PpsSource::Config config{.interface = Interface::Kernel, .path = device_, .line = 0, .edge = edge_};
    if (!socket_.empty()) {
      config.interface = Interface::Socket;
      config.path = socket_;
    } else if (!serial_.empty()) {
      config.interface = Interface::Serial;
      config.path = serial_;
    } else if (gpio_) {
      config.interface = Interface::Gpio;
      config.path = gpio_->chip;
      config.line = gpio_->line;
    }
    return std::make_unique<PpsSource>(std::move(config));
  }
  std::unique_ptr<Decoder> make_decoder() const override {
    if (ptp_) return std::make_unique<PtpDecoder>(ptp_->scale);
    return std::make_unique<PpsDecoder>(PpsDecoder::Config{.edge = edge_});
  }

 private:
  std::string device_, socket_, serial_;
  std::optional<GpioKeys> gpio_;
  std::optional<PtpKeys> ptp_;
  PpsEdgeKind edge_ = PpsEdgeKind::Assert;
};

}  // namespace

constinit const DeviceType kPps{"pps", Role::Pps, false, make_device<PpsDevice>};

}  // namespace hueline::drivers
