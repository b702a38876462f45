#include "apps/simulate/simulated_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "drivers/can/can_frame.hpp"
#include "drivers/gige/image_packet.hpp"
#include "drivers/pps/pps_packet.hpp"
#include "sim/wire/can_encode.hpp"

namespace hueline::apps {

std::array<SensorId, sim::kWireChannels> sensors_of_channels(const config::Rig& rig) {
  std::array<SensorId, sim::kWireChannels> out{};
  const auto set = [&](sim::WireChannel channel, SensorId id) {
    SensorId& place = out[static_cast<std::size_t>(channel)];
    if (place == kSystemSensor) place = id;
  };
  for (const auto& sensor : rig.sensors) {
    switch (sensor.type->role) {
      case drivers::Role::Laser:
        set(sim::WireChannel::LaserData, sensor.id);
        set(sim::WireChannel::LaserPosition, sensor.id);
        break;
      case drivers::Role::Pos:
        set(sim::WireChannel::Pos, sensor.id);
        break;
      case drivers::Role::Pps:
        set(sim::WireChannel::Pps, sensor.id);
        break;
      case drivers::Role::Camera:
        set(sim::WireChannel::Camera, sensor.id);
        break;
      case drivers::Role::Odometer:
        set(sim::WireChannel::Wheel, sensor.id);
        break;
    }
  }
  return out;
}

namespace {

/// Returns the image in the form in which the camera's source delivers it: our header, then the pixels.
Result<Buffer> image_bytes(const sim::Drive& drive, const sim::WireEvent& event, PixelFormat format, BufferPool& pool) {
  const std::size_t pixels = std::size_t{event.width} * event.height;
  MutableBuffer buffer = pool.acquire(drivers::kImageHeaderSize + pixels);
  if (!buffer) return Error{ErrorCode::Exhausted, "more images held than the pool has room for"};
  drivers::ImageHeader header;
  header.width = event.width;
  header.height = event.height;
  header.stride = event.width;
  header.pfnc = drivers::pfnc_code(format);
  header.frame_id = event.sequence + 1;
  header.missing_packets = event.missing_packets;
  if (event.missing_packets > 0) header.status = drivers::ImageStatus::TimedOut;
  header.time = DeviceTime<CameraCounter>(nanoseconds(event.camera_counter_ns));
  header.exposure = nanoseconds(event.reported_exposure_ns);
  header.gain = event.reported_gain;
  drivers::encode_image_header(
      header, std::span<std::byte, drivers::kImageHeaderSize>(buffer.data(), drivers::kImageHeaderSize));
  const auto path = std::filesystem::path(drive.cache_dir) / event.image_file;
  std::ifstream in(path, std::ios::binary);
  if (!in) return io_error("open " + path.string(), errno);
  in.read(reinterpret_cast<char*>(buffer.data() + drivers::kImageHeaderSize), static_cast<std::streamsize>(pixels));
  if (static_cast<std::size_t>(in.gcount()) != pixels)
    return Error{ErrorCode::Truncated, fmt::format("{}: {} bytes, {} expected", path.string(), in.gcount(), pixels)};
  return std::move(buffer).share();
}

/// Returns the pixel format that the camera is set to send.
PixelFormat sent_format(const config::Rig& rig, SensorId id) {
  for (const auto& sensor : rig.sensors)
    if (const auto* camera = dynamic_cast<const drivers::CameraDevice*>(sensor.device.get()); camera && sensor.id == id)
      return camera->sent_format();
  return PixelFormat::BayerRG8;
}

/// Returns a frame in the form in which the CAN source delivers it, or as the gateway's datagram.
Buffer can_bytes(const config::Sensor& sensor, const sim::Bytes& frame, std::uint8_t datagram) {
  const auto* odometer = dynamic_cast<const drivers::OdometerDevice*>(sensor.device.get());
  if (odometer && odometer->is_by_gateway()) return Buffer::copy_of(sim::encode_cannelloni(frame, datagram));
  std::vector<std::byte> packet = drivers::encode_can_packet({});
  std::copy(frame.begin(), frame.end(), packet.begin() + drivers::kCanHeaderSize);
  return Buffer::copy_of(packet);
}

}  // namespace

Status for_each_simulated_packet(const sim::Drive& drive, const sim::Timeline& timeline, const config::Rig& rig,
                                 const std::function<bool(const Packet&)>& use) {
  const auto sensors = sensors_of_channels(rig);
  BufferPool pool(std::size_t{1} << 31);
  std::uint64_t sequence = 0;
  std::uint8_t can_datagrams = 0;
  const auto hand_over = [&](Packet&& packet) {
    packet.sequence = sequence++;
    return use(packet);
  };
  for (const sim::WireEvent& event : timeline.events) {
    Packet packet;
    packet.sensor = sensors[static_cast<std::size_t>(event.channel)];
    if (packet.sensor == kSystemSensor)
      return Error{ErrorCode::Invalid,
                   fmt::format("the rig has no sensor for the channel {}", sim::name(event.channel))};
    packet.received = kSimulatedHostBegin + nanoseconds(event.at_ns);
    if (event.channel == sim::WireChannel::Pps) {
      packet.received = kSimulatedHostBegin + nanoseconds(event.edge_ns);
      packet.bytes =
          Buffer::copy_of(drivers::encode_pps({drivers::PpsEdgeKind::Assert, event.sequence, packet.received}));
    } else if (event.channel == sim::WireChannel::Camera) {
      Result<Buffer> bytes = image_bytes(drive, event, sent_format(rig, packet.sensor), pool);
      if (!bytes.ok()) return bytes.error();
      packet.bytes = std::move(*bytes);
    } else if (event.channel == sim::WireChannel::Wheel) {
      packet.bytes = can_bytes(rig.sensors[packet.sensor - 1u], event.payload, can_datagrams++);
    } else {
      const std::span<const std::byte> payload(event.payload);
      const std::size_t piece = event.piece_bytes > 0 ? event.piece_bytes : payload.size();
      for (std::size_t at = piece; at < payload.size(); at += piece) {
        Packet part = packet;
        part.bytes = Buffer::copy_of(payload.subspan(at - piece, piece));
        if (!hand_over(std::move(part))) return {};
      }
      packet.bytes = Buffer::copy_of(payload.subspan(payload.empty() ? 0 : (payload.size() - 1) / piece * piece));
    }
    const SensorId sensor = packet.sensor;
    const HostTime received = packet.received;
    if (!hand_over(std::move(packet))) return {};
    if (event.missing_packets > 0) {
      // This fault has the form in which the camera's source reports it.
      Packet told;
      told.sensor = sensor;
      told.kind = PacketKind::Fault;
      told.received = received;
      told.bytes = Buffer::copy_of(
          encode_fault({sensor, FaultKind::Lost, received, 1,
                        fmt::format("1 images incomplete: {} packets missing, 0 came when asked for again",
                                    event.missing_packets)}));
      if (!hand_over(std::move(told))) return {};
    }
  }
  return {};
}

}  // namespace hueline::apps
