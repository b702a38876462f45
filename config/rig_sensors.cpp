#include <fmt/format.h>

#include <cmath>

#include "config/mounting.hpp"
#include "config/rig.hpp"
#include "config/rig_time.hpp"
#include "config/rig_transport.hpp"
#include "config/rig_wheel.hpp"

namespace hueline::config {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;

/// A driver's own check of several keys together, told at the sensor.
void require_valid(const Section& section, const std::string& key, const std::string& wrong) {
  if (!wrong.empty()) section.refuse(key, wrong);
}

drivers::PcapSource::Config read_pcap(Section section) {
  drivers::PcapSource::Config out;
  out.path = section.text("file");
  if (section.has("ports"))
    for (const std::int64_t port : section.integers("ports", {1, 65535})) out.ports.push_back(static_cast<std::uint16_t>(port));
  out.source_address = section.text("source_address", out.source_address);
  require_valid(section, "file", out.validate());
  section.finish();
  return out;
}

std::variant<drivers::UdpSource::Config, drivers::PcapSource::Config> read_datagrams(Section& section) {
  if (section.one_of({"udp", "pcap"}) == "pcap") return read_pcap(section.section("pcap"));
  return read_udp(section.section("udp"));
}

void read_mount(Section& section, SensorId id, fusion::RigGeometry& geometry) {
  fusion::LaserMount mount;
  mount.sensor = id;
  mount.T_body_scanner = read_transform<Body, Scanner>(section, "T_body_scanner");
  mount.sigma_range_m = section.number("sigma_range_m", {0, 10}, mount.sigma_range_m);
  geometry.lasers.push_back(mount);
}

VelodyneSensor read_velodyne(Section& section, SensorId id, fusion::RigGeometry& geometry) {
  VelodyneSensor out;
  out.source = read_datagrams(section);
  auto& decoder = out.decoder;
  decoder.model = section.choice<drivers::VelodyneModel>(
      "model", {{"VLP-16", drivers::VelodyneModel::Vlp16}, {"HDL-32E", drivers::VelodyneModel::Hdl32e}});
  decoder.returns = section.choice<drivers::ReturnChoice>("returns",
                                                          {{"all", drivers::ReturnChoice::All},
                                                           {"strongest", drivers::ReturnChoice::Strongest},
                                                           {"last", drivers::ReturnChoice::Last}},
                                                          decoder.returns);
  decoder.min_range_m = section.number("min_range_m", {0, 131}, decoder.min_range_m);
  decoder.max_range_m = section.number("max_range_m", {0, 200}, decoder.max_range_m);
  decoder.azimuth_begin = section.number("azimuth_begin_deg", {0, 360}, decoder.azimuth_begin / kDeg) * kDeg;
  decoder.azimuth_end = section.number("azimuth_end_deg", {0, 360}, decoder.azimuth_end / kDeg) * kDeg;
  decoder.detects_lost = section.boolean("detects_lost", decoder.detects_lost);
  require_valid(section, "model", decoder.validate());
  read_mount(section, id, geometry);
  return out;
}

ProfileScannerSensor read_profile_scanner(Section& section, SensorId id, fusion::RigGeometry& geometry) {
  ProfileScannerSensor out;
  out.source = read_datagrams(section);
  auto& decoder = out.decoder;
  decoder.scanner_id = static_cast<int>(section.integer("scanner_id", {0, 65535}, decoder.scanner_id));
  decoder.min_range_m = section.number("min_range_m", {0, 1000}, decoder.min_range_m);
  decoder.max_range_m = section.number("max_range_m", {0, 10000}, decoder.max_range_m);
  decoder.angle_begin = section.number("angle_begin_deg", {0, 360}, decoder.angle_begin / kDeg) * kDeg;
  decoder.angle_end = section.number("angle_end_deg", {0, 360}, decoder.angle_end / kDeg) * kDeg;
  require_valid(section, "min_range_m", decoder.validate());
  read_mount(section, id, geometry);
  return out;
}

std::string read_dialogue(Section section) {
  drivers::NovatelLogs::Config logs;
  logs.unlog_first = section.boolean("unlog_first", logs.unlog_first);
  logs.ins_rate_hz = section.number("ins_rate_hz", {0, 1000}, logs.ins_rate_hz);
  logs.ins_extended_rate_hz = section.number("ins_extended_rate_hz", {0, 1000}, logs.ins_extended_rate_hz);
  logs.ins_stdev_rate_hz = section.number("ins_stdev_rate_hz", {0, 1000}, logs.ins_stdev_rate_hz);
  logs.time_rate_hz = section.number("time_rate_hz", {0, 20}, logs.time_rate_hz);
  logs.position_rate_hz = section.number("position_rate_hz", {0, 100}, logs.position_rate_hz);
  if (section.has("mark_inputs")) {
    logs.mark_inputs.clear();
    for (const std::int64_t input : section.integers("mark_inputs", {1, 4})) logs.mark_inputs.push_back(static_cast<int>(input));
  }
  logs.raw_imu = section.boolean("raw_imu", logs.raw_imu);
  if (section.has("commands")) logs.commands = section.texts("commands");
  const Result<std::string> dialogue = drivers::novatel_dialogue(logs);
  if (!dialogue.ok()) section.refuse("ins_rate_hz", dialogue.error().message);
  section.finish();
  return *dialogue;
}

NovatelSensor read_novatel(Section& section) {
  NovatelSensor out;
  const std::string dialogue = section.has("logs") ? read_dialogue(section.section("logs")) : std::string();
  const std::string from = section.one_of({"tcp", "serial", "file"});
  if (from == "file") {
    drivers::FileSource::Config file;
    file.path = section.text("file");
    out.source = file;
  } else if (from == "serial") {
    Section inside = section.section("serial");
    drivers::SerialSource::Config serial;
    serial.device = inside.text("device");
    serial.baud = static_cast<int>(inside.integer("baud", {300, 4000000}));
    serial.stream.dialogue = dialogue;
    require_valid(inside, "device", serial.validate());
    inside.finish();
    out.source = serial;
  } else {
    Section inside = section.section("tcp");
    drivers::TcpSource::Config tcp;
    tcp.host = inside.text("host");
    tcp.port = static_cast<int>(inside.integer("port", {1, 65535}));
    tcp.stream.dialogue = dialogue;
    require_valid(inside, "host", tcp.validate());
    inside.finish();
    out.source = tcp;
  }
  out.decoder.accepts_alignment_complete = section.boolean("accept_alignment_complete", out.decoder.accepts_alignment_complete);
  require_valid(section, "driver", out.decoder.validate());
  return out;
}

PixelFormat read_pixel_format(Section& section) {
  std::vector<std::pair<std::string, PixelFormat>> words;
  for (const PixelFormat format : {PixelFormat::Mono8, PixelFormat::BayerRG8, PixelFormat::BayerBG8, PixelFormat::BayerGR8,
                                   PixelFormat::BayerGB8, PixelFormat::Rgb8})
    words.emplace_back(name(format), format);
  return section.choice<PixelFormat>("pixel_format", words);
}

CameraSensor read_camera(Section& section) {
  CameraSensor out;
  auto& source = out.source;
  source.address = section.text("address", "");
  source.interface = section.text("interface", "");
  source.id = section.text("id", "");
  source.serial = section.text("serial", "");
  source.width = static_cast<std::uint32_t>(section.integer("width", {1, 65535}));
  source.height = static_cast<std::uint32_t>(section.integer("height", {1, 65535}));
  source.pixel_format = read_pixel_format(section);
  source.exposure = from_seconds(section.number("exposure_us", {1, 1e6}) * 1e-6);
  if (section.has("gain")) source.gain = section.number("gain", {-100, 100});
  source.frame_rate_hz = section.number("frame_rate_hz", {0, 1000}, 0.0);
  source.trigger_source = section.text("trigger_source", "");
  source.trigger_activation = section.choice<drivers::TriggerActivation>(
      "trigger_activation",
      {{"rising", drivers::TriggerActivation::RisingEdge}, {"falling", drivers::TriggerActivation::FallingEdge}},
      source.trigger_activation);
  source.features = section.text("features", "");
  source.packet_size = static_cast<std::uint32_t>(section.integer("packet_size", {0, 65535}, 0));
  source.packet_delay = from_seconds(section.number("packet_delay_us", {0, 10000}, 0.0) * 1e-6);
  source.packet_resend = section.boolean("packet_resend", source.packet_resend);
  source.packet_socket = section.boolean("packet_socket", source.packet_socket);
  source.realtime_priority = static_cast<int>(section.integer("realtime_priority", {0, 99}, 0));
  source.stream_buffers = static_cast<std::size_t>(section.integer("stream_buffers", {2, 256}, static_cast<std::int64_t>(source.stream_buffers)));
  source.images_in_flight = static_cast<std::size_t>(section.integer("images_in_flight", {1, 4096}, static_cast<std::int64_t>(source.images_in_flight)));
  out.decoder.width = source.width;
  out.decoder.height = source.height;
  out.decoder.pixel_format = source.pixel_format;
  out.decoder.payload = section.choice<drivers::ImagePayload>(
      "payload", {{"rows", drivers::ImagePayload::Rows}, {"jpeg_planes", drivers::ImagePayload::JpegPlanes}}, out.decoder.payload);
  if (out.decoder.payload == drivers::ImagePayload::JpegPlanes) {
    auto& planes = out.decoder.planes;
    planes.lens_columns = static_cast<std::uint32_t>(section.integer("lens_columns", {1, 6}, planes.lens_columns));
    if (section.has("plane_places")) {
      const auto places = section.integers("plane_places", {0, 3});
      if (places.size() != planes.plane_places.size()) section.refuse("plane_places", "allowed: four places, each once");
      for (std::size_t i = 0; i < places.size(); ++i) planes.plane_places[i] = static_cast<std::uint8_t>(places[i]);
    }
    // Its buffer has a size of its own, and to the transport it holds bytes.
    source.width = source.height = 0;
    source.pixel_format = PixelFormat::Mono8;
  }
  require_valid(section, "driver", source.validate());
  require_valid(section, "width", out.decoder.validate());
  return out;
}

PpsSensor read_pps(Section& section, SensorId id) {
  PpsSensor out;
  out.source.sensor = id;
  if (section.one_of({"device", "socket"}) == "socket") {
    out.source.interface = drivers::PpsSource::Interface::Socket;
    out.source.path = section.text("socket");
  } else {
    out.source.path = section.text("device");
  }
  out.source.edge = section.choice<drivers::PpsEdgeKind>(
      "edge", {{"assert", drivers::PpsEdgeKind::Assert}, {"clear", drivers::PpsEdgeKind::Clear}}, out.source.edge);
  out.decoder.edge = out.source.edge;
  require_valid(section, "driver", out.source.validate());
  return out;
}

enum class Driver { Velodyne, Novatel, Genicam, Pps, ProfileScanner, Wheel };

/// A pcap's stamps are of the clock of the computer that captured: beside them, what arrives now has no place.
void require_one_time(const Section& rig, const std::vector<Sensor>& sensors) {
  const Sensor *recorded = nullptr, *live = nullptr;
  for (const Sensor& sensor : sensors) {
    if (sensor.arrivals() == Arrivals::Recorded) recorded = &sensor;
    if (sensor.arrivals() == Arrivals::Live) live = &sensor;
  }
  if (recorded && live)
    rig.refuse("sensors", fmt::format("{} is read from a pcap file and {} from a device: they have no time in common; allowed: all from files, or all from devices",
                                      recorded->name, live->name));
}

/// A receiver's log does not tell when its bytes arrived: the clocks have to be learnt from the others. Where all are files there is
/// nothing to learn, and each device's own clock has to do.
void untie_from_log(const std::vector<Sensor>& sensors, sync::Synchroniser::Config& sync) {
  std::vector<SensorId> others{kSystemSensor};  // nobody; an empty list would be everybody
  bool has_log = false;
  sync.self_timed = true;
  for (const Sensor& sensor : sensors) {
    sync.self_timed &= sensor.arrivals() != Arrivals::Live;
    has_log |= sensor.arrivals() == Arrivals::Unknown;
    if (sensor.arrivals() != Arrivals::Unknown) others.push_back(sensor.id);
  }
  if (!has_log) return;
  sync.clock.label.trusted = kSystemSensor;
  sync.label_sources = sync.arrival_sources = others;
}

}  // namespace

drivers::UdpSource::Config read_udp(Section section) {
  drivers::UdpSource::Config out;
  out.ports.clear();
  for (const std::int64_t port : section.integers("ports", {1, 65535})) out.ports.push_back(static_cast<std::uint16_t>(port));
  out.bind_address = section.text("bind_address", out.bind_address);
  out.source_address = section.text("source_address", out.source_address);
  out.multicast_group = section.text("multicast_group", out.multicast_group);
  out.multicast_interface = section.text("multicast_interface", out.multicast_interface);
  out.receive_buffer_bytes = static_cast<int>(section.integer("receive_buffer_bytes", {4096, 1 << 30}, out.receive_buffer_bytes));
  require_valid(section, "ports", out.validate());
  section.finish();
  return out;
}

std::vector<Sensor> read_sensors(Section& rig, fusion::RigGeometry& geometry, sync::Synchroniser::Config& sync) {
  std::vector<Sensor> out;
  for (Section& section : rig.list("sensors")) {
    Sensor sensor;
    sensor.id = static_cast<SensorId>(out.size() + 1);
    sensor.name = section.text("name");
    if (sensor.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos || sensor.name == "hueline")
      section.refuse("name", "allowed: small letters, digits and _, but not hueline");
    for (const Sensor& other : out)
      if (other.name == sensor.name) section.refuse("name", "'" + sensor.name + "' is taken by another sensor");
    sensor.silent_after_s = section.number("silent_after_s", {0.2, 3600}, sensor.silent_after_s);
    switch (section.choice<Driver>("driver", {{"velodyne", Driver::Velodyne},
                                              {"novatel", Driver::Novatel},
                                              {"genicam", Driver::Genicam},
                                              {"pps", Driver::Pps},
                                              {"profile_scanner", Driver::ProfileScanner},
                                              {"wheel", Driver::Wheel}})) {
      case Driver::Velodyne:
        sensor.device = read_velodyne(section, sensor.id, geometry);
        add_laser(sensor.id, sync);
        break;
      case Driver::ProfileScanner:
        sensor.device = read_profile_scanner(section, sensor.id, geometry);
        add_profile_scanner(sensor.id, sync);
        break;
      case Driver::Novatel:
        sensor.device = read_novatel(section);
        add_pos(section, sensor.id, sync);
        break;
      case Driver::Genicam:
        sensor.device = read_camera(section);
        add_camera(section, sensor.id, *std::get<CameraSensor>(sensor.device).source.exposure, sync);
        break;
      case Driver::Pps:
        sensor.device = read_pps(section, sensor.id);
        add_pps(section, sensor.id, sync);
        break;
      case Driver::Wheel:
        sensor.device = read_wheel(section);
        add_wheel(section, sensor.id, sync);
        break;
    }
    section.finish();
    out.push_back(std::move(sensor));
  }
  if (out.empty()) rig.refuse("sensors", "names no sensor");
  require_one_time(rig, out);
  untie_from_log(out, sync);
  return out;
}

}  // namespace hueline::config
