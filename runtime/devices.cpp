#include "runtime/devices.hpp"

#include "drivers/guest/config_text.hpp"
#include "drivers/guest/guest_source.hpp"
#include "drivers/profile_scanner/profile_scanner_decoder.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"
#include "drivers/wheel/wheel_decoder.hpp"

namespace hueline::runtime {
namespace {

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

/// Aravis is a guest: it may crash, and nobody else notices.
std::unique_ptr<PacketSource> make_guest(const config::Sensor& sensor, const config::CameraSensor& camera) {
  drivers::GuestSource::Config guest;
  guest.sensor = sensor.id;
  guest.driver = sensor.driver();
  guest.text = drivers::write_config(camera.source);
  guest.slots = camera.source.stream_buffers + camera.source.images_in_flight;
  return std::make_unique<drivers::GuestSource>(std::move(guest));
}

}  // namespace

std::unique_ptr<PacketSource> make_source(const config::Sensor& sensor, const BufferPool& pool) {
  using namespace drivers;
  using Source = std::unique_ptr<PacketSource>;
  const Overloaded transport{
      [&](const UdpSource::Config& c) -> Source { return std::make_unique<UdpSource>(sensor.id, c, pool); },
      [&](const CanSource::Config& c) -> Source { return std::make_unique<CanSource>(sensor.id, c, pool); },
      [&](const CanLogSource::Config& c) -> Source { return std::make_unique<CanLogSource>(sensor.id, c); },
      [&](const PcapSource::Config& c) -> Source { return std::make_unique<PcapSource>(sensor.id, c); },
      [&](const TcpSource::Config& c) -> Source { return std::make_unique<TcpSource>(c); },
      [&](const SerialSource::Config& c) -> Source { return std::make_unique<SerialSource>(c); },
      [&](const FileSource::Config& c) -> Source { return std::make_unique<FileSource>(c); },
  };
  return std::visit(Overloaded{
                        [&](const config::VelodyneSensor& s) { return std::visit(transport, s.source); },
                        [&](const config::ProfileScannerSensor& s) { return std::visit(transport, s.source); },
                        [&](const config::NovatelSensor& s) { return std::visit(transport, s.source); },
                        [&](const config::WheelSensor& s) { return std::visit(transport, s.source); },
                        [&](const config::CameraSensor& s) -> Source { return make_guest(sensor, s); },
                        [&](const config::PpsSensor& s) -> Source { return std::make_unique<PpsSource>(s.source); },
                    },
                    sensor.device);
}

std::unique_ptr<Decoder> make_decoder(const config::Sensor& sensor) {
  using namespace drivers;
  using Made = std::unique_ptr<Decoder>;
  return std::visit(Overloaded{
                        [&](const config::VelodyneSensor& s) -> Made { return std::make_unique<VelodyneDecoder>(sensor.id, s.decoder); },
                        [&](const config::ProfileScannerSensor& s) -> Made { return std::make_unique<ProfileScannerDecoder>(sensor.id, s.decoder); },
                        [&](const config::NovatelSensor& s) -> Made { return std::make_unique<NovatelDecoder>(s.decoder); },
                        [&](const config::CameraSensor& s) -> Made { return std::make_unique<ImageDecoder>(s.decoder); },
                        [&](const config::PpsSensor& s) -> Made { return std::make_unique<PpsDecoder>(s.decoder); },
                        [&](const config::WheelSensor& s) -> Made { return std::make_unique<WheelDecoder>(sensor.id, s.decoder); },
                    },
                    sensor.device);
}

}  // namespace hueline::runtime
