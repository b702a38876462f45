#include "drivers/pps/pps_source.hpp"

#include <sys/un.h>

#include <fmt/format.h>

#include "drivers/pps/gpio_pps.hpp"
#include "drivers/pps/kernel_pps.hpp"
#include "drivers/pps/serial_pps.hpp"
#include "drivers/pps/socket_pps.hpp"

namespace hueline::drivers {

namespace {

std::unique_ptr<PacketSource> make(const PpsSource::Config& config) {
  if (config.interface == PpsSource::Interface::Socket) return std::make_unique<SocketPps>(config.path);
  if (config.interface == PpsSource::Interface::Serial) return std::make_unique<SerialPps>(config.path, config.edge);
  if (config.interface == PpsSource::Interface::Gpio)
    return std::make_unique<GpioPps>(GpioLine{config.path, config.line}, config.edge);
  return std::make_unique<KernelPps>(config.path, config.edge);
}

}  // namespace

std::string PpsSource::Config::validate() const {
  if (path.empty()) return "path: is empty";
  if (interface != Interface::Socket && path.front() != '/')
    return fmt::format("path: '{}' is not an absolute path", path);
  if (interface == Interface::Socket && path.size() >= sizeof(sockaddr_un::sun_path))
    return fmt::format("path: a socket's path has at most {} characters, this one {}",
                       sizeof(sockaddr_un::sun_path) - 1, path.size());
  if (edge != PpsEdgeKind::Assert && edge != PpsEdgeKind::Clear) return "edge: assert or clear";
  return {};
}

PpsSource::PpsSource(Config config) : source_(make(config)) {}
PpsSource::~PpsSource() = default;

}  // namespace hueline::drivers
