#include "config/rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <utility>

#include "config/key_reader.hpp"
#include "config/shipped.hpp"
#include "drivers/stamped_device.hpp"

namespace hueline::config {
namespace {

using drivers::Arrivals;
using drivers::Role;

bool is_sensor_name(const std::string& text) {
  return text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string::npos && text != "hueline";
}
const TextForm kChecklistItem{"a sentence of at most 120 characters",
                              [](const std::string& text) { return !text.empty() && text.size() <= 120; },
                              "^.{1,120}$"};
const TextForm kNotKnown{"a sentence", [](const std::string& text) { return !text.empty(); }, "^.+$"};
const TextForm kSensorName{"small letters, digits and _, but not hueline", is_sensor_name, "^[a-z0-9_]+$"};

/// The keys of one sensor: those that every sensor has, those of its device, and those that its role has for clocks and
/// points.
struct SensorKeys {
  drivers::DeviceTypes types;
  Sensor sensor{};
  std::shared_ptr<drivers::Device> device{};
  fusion::LaserMount mount{};
  sync::ExposureMatcher::Config exposures{};
  sync::HostClockModel::Config clock{};
  sync::WheelOdometer::Config wheel{};

  void visit(Keys& keys) {
    keys.text(required("name", "", "The sensor's name in recordings, logs and topics. No other sensor has it."),
              sensor.name, kSensorName);
    keys.number({"silent_after_s", "s", "A connected sensor that sends no packet for this long causes a fault Silent."},
                sensor.silent_after_s, {0.2, 3600});
    KeyKinds drivers;
    drivers.has_tables = true;
    for (const drivers::DeviceType* type : types) drivers.words.emplace_back(type->word);
    drivers.make = [this](std::size_t word) {
      sensor.type = types[word];
      device = types[word]->make();
      return KeyGroup{[this](Keys& inside) { visit_device(inside); }, [this] { return check_device(); }};
    };
    keys.kinds(required("driver", "", "What kind of device it is. It decides which further keys the sensor has."),
               drivers);
  }
  KeyError validate() const { return {}; }

 private:
  void visit_device(Keys& keys) {
    device->visit(keys);
    switch (sensor.type->role) {
      case Role::Laser:
        return mount.visit(keys);
      case Role::Camera:
        return exposures.visit(keys);
      case Role::Pps:
        return clock.visit(keys);
      case Role::Odometer:
        return wheel.visit(keys);
      case Role::Pos:
        return;
    }
  }
  KeyError check_device() const {
    if (KeyError wrong = device->validate(); !wrong.empty()) return wrong;
    switch (sensor.type->role) {
      case Role::Laser:
        return mount.validate();
      case Role::Camera:
        return exposures.validate();
      case Role::Pps:
        return clock.validate();
      case Role::Odometer:
        return wheel.validate();
      case Role::Pos:
        return {};
    }
    return {};
  }
};

const TextForm kSplit{"time:60s, distance:500m or tile:100m, with a size from 0.1 to 1000000",
                      [](const std::string& text) { return storage::CloudSplit::parse(text).ok(); },
                      "^(time:[0-9.]+s?|(distance|tile):[0-9.]+m?)$"};

struct CloudKeys {
  storage::MapConfig map{};
  storage::CloudFormat format = storage::CloudFormat::Las;
  std::string split{};

  void visit(Keys& keys) {
    keys.choice(
        {"format", "",
         "Whether the cloud is written as `cloud.las`, or compressed as `cloud.laz`, which takes two "
         "fifths of the space and the time of half a processor core for a million points a second, or as "
         "`cloud.copc.laz` (COPC), which viewers load in parts. COPC takes 350 MB of memory and three quarters "
         "of a core for that, and its points do not stand in the order of the drive."},
        format,
        {{"las", storage::CloudFormat::Las}, {"laz", storage::CloudFormat::Laz}, {"copc", storage::CloudFormat::Copc}});
    keys.text(
        {"split", "",
         "Parts of the cloud that are written beside it while the vehicle drives, as LAZ files in the folder `parts`: "
         "strips of the drive by seconds of GPS time or metres of the path, or square tiles of the map. They are the "
         "files that `hueline export --split` makes of a cloud whose points stand in the order of the drive, and take "
         "the space of `cloud.laz`, up to 170 MB of memory and the time of two thirds of a processor core for a "
         "million points a second.",
         "none"},
        split, kSplit);
    map.visit(keys);
  }
  KeyError validate() const { return map.validate(); }
};

/// The keys of a rig file, and the Rig that they become.
struct RigKeys {
  drivers::DeviceTypes types;
  std::deque<SensorKeys> sensors{};
  std::optional<fusion::CameraHeadGeometry> head{};
  CloudKeys cloud{};
  Rig rig{};

  void visit(Keys& keys) {
    keys.text(required("rig", "", "The rig's name, for people."), rig.name);
    keys.list(
        required("sensors", "", "The devices. Their order gives each its number: 1, 2, ..."),
        KeyList{sensors.size(), [this] { sensors.clear(); }, [this](std::size_t i) { return group_of(sensors[i]); },
                [this] { return group_of(sensors.emplace_back(SensorKeys{types})); }},
        {1, 250});
    keys.section(
        {"head", "",
         "The camera head: where its lenses are mounted. It is required with a camera, and refused without one.",
         "none"},
        head);
    keys.section(required("colouring", "", "How points get their colour."), rig.colouring);
    keys.section({"watch", "", "How images and laser are watched for a drift of mounting and times."}, rig.watch);
    keys.section({"cloud", "", "The file of the coloured points, and the parts of it that are written beside it."},
                 cloud);
    keys.section({"panoramas", "",
                  "Panoramas that are made of the recording while the vehicle drives, in the folder `panoramas` of the "
                  "drive: those that `hueline panorama` makes afterwards with options of the same names.",
                  "none"},
                 rig.panoramas);
    keys.section({"images", "",
                  "Images of the lenses with their poses that are written while the vehicle drives, in the folder "
                  "`images` of the drive: those that `hueline export --profile images --points 0` writes afterwards "
                  "with options of the same names.",
                  "none"},
                 rig.images);
    keys.section(
        {"recording", "", "How the recording is split into files, what of it is kept, and how images are stored."},
        rig.recording);
    keys.texts({"checklist", "",
                "What people look at before a drive, such as the caps of the lenses: `check` shows it, and the console "
                "asks for each.",
                "nothing"},
               rig.checklist, kChecklistItem);
    keys.texts(
        {"not_known", "",
         "What of this file is guessed because nobody has entered it yet, in words. A drive with it is usable with "
         "remarks at best, and says why. Remove a line when its value is entered.",
         "nothing"},
        rig.not_known, kNotKnown);
    keys.number({"end_within_s", "s",
                 "How long a drive may take to end after it was asked to, for a vehicle whose ignition cuts the power. "
                 "Then it ends at once: `drive.mcap` is whole, cloud and view end early. 0: as long as it takes."},
                rig.end_within_s, {0, 3600});
    keys.section({"time", "", "How long the clocks wait, and what they accept."}, rig.sync);
    keys.section({"health", "", "What is accepted before the program warns, and before a drive is to be driven again."},
                 rig.health);
  }

  /// Checks what concerns several sensors, and completes the Rig.
  KeyError complete() {
    rig.map = cloud.map;
    rig.cloud_format = cloud.format;
    if (!cloud.split.empty()) rig.cloud_split = storage::CloudSplit::parse(cloud.split).value();
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      SensorKeys& one = sensors[i];
      one.sensor.id = static_cast<SensorId>(i + 1);
      one.sensor.device = one.device;
      for (std::size_t j = 0; j < i; ++j)
        if (sensors[j].sensor.name == one.sensor.name)
          return {fmt::format("sensors[{}].name", i),
                  fmt::format("is '{}', as that of another sensor; allowed: each name once", one.sensor.name)};
      if (KeyError wrong = take_role(one); !wrong.empty()) return wrong.inside(fmt::format("sensors[{}]", i));
      rig.sensors.push_back(one.sensor);
    }
    for (const auto& check : {&RigKeys::require_one_time, &RigKeys::place_head})
      if (KeyError wrong = (this->*check)(); !wrong.empty()) return wrong;
    untie_from_log();
    for (const auto& [key, is_there] :
         {std::pair("panoramas", rig.panoramas.has_value()), {"images", rig.images.has_value()}})
      if (is_there && !head) return {key, "needs a camera head: the rig has no key head"};
    if (const std::string wrong = rig.geometry.validate(); !wrong.empty()) return {"", wrong};
    return {"", rig.sync.validate()};
  }

 private:
  /// Enters a sensor into the configurations of the clocks and the points, by its role.
  KeyError take_role(SensorKeys& one) {
    const SensorId id = one.sensor.id;
    sync::Synchroniser::Config& sync = rig.sync;
    switch (one.sensor.type->role) {
      case Role::Laser: {
        one.mount.sensor = id;
        rig.geometry.lasers.push_back(one.mount);
        sync::LaserClock::Config& laser = sync.lasers.emplace_back();
        laser.sensor = id;
        laser.latency_min = one.sensor.type->laser.latency_min;
        laser.pending_limit = one.sensor.type->laser.pending_limit;
        if (const auto* stamped = dynamic_cast<const drivers::StampedDevice*>(one.device.get()))
          laser.latency_min_sigma = laser.discipline.sigma = stamped->stamp_sigma();
        return {};
      }
      case Role::Camera: {
        const auto& camera = dynamic_cast<const drivers::CameraDevice&>(*one.device);
        one.exposures.camera = id;
        one.exposures.exposure = camera.exposure();
        one.exposures.must_report = camera.must_report();
        sync.cameras.push_back(one.exposures);
        return one.exposures.validate();
      }
      case Role::Pos:
        if (sync.pos != kSystemSensor) return {"driver", "is that of a second POS; allowed: one POS a rig"};
        sync.pos = id;
        sync.clock.label.trusted = id;
        // Only the receiver itself is a source of labels. A scanner's position packets repeat what the receiver told
        // it, but later and by the scanner's own clock.
        sync.label_sources.push_back(id);
        sync.arrival_sources.push_back(id);
        return {};
      case Role::Pps:
        if (sync.clock.pps != kSystemSensor) return {"driver", "is that of a second PPS; allowed: one PPS a rig"};
        sync.clock.pps = id;
        sync.clock.edge_delay = one.clock.edge_delay;
        if (dynamic_cast<const drivers::PulseDevice&>(*one.device).names_seconds()) sync.label_sources.push_back(id);
        return {};
      case Role::Odometer:
        one.wheel.sensor = id;
        sync.wheels.push_back(one.wheel);
        return {};
    }
    return {};
  }

  /// Refuses a rig of capture files and devices together. The stamps of a capture file are those of the computer that
  /// captured it, so packets that arrive now cannot be ordered among them.
  KeyError require_one_time() {
    const Sensor *recorded = nullptr, *live = nullptr;
    for (const Sensor& sensor : rig.sensors) {
      if (sensor.device->arrivals() == Arrivals::Recorded) recorded = &sensor;
      if (sensor.device->arrivals() == Arrivals::Live) live = &sensor;
    }
    if (!recorded || !live) return {};
    return {"sensors", fmt::format("have no time in common: {} is read from a capture file and {} from a device; "
                                   "allowed: all from files, or all from devices",
                                   recorded->name, live->name)};
  }

  KeyError place_head() {
    const bool has_camera =
        std::ranges::any_of(rig.sensors, [](const Sensor& sensor) { return sensor.type->role == Role::Camera; });
    if (head && !has_camera) return {"head", "needs a sensor that is a camera and delivers its images"};
    if (!head && has_camera) return {"head", "is missing: where the camera's lenses sit"};
    if (!head) return {};
    for (std::size_t i = 0; i < head->lenses.size(); ++i) {
      fusion::LensMount& lens = head->lenses[i];
      std::string cameras;
      for (const Sensor& sensor : rig.sensors) {
        if (sensor.type->role != Role::Camera) continue;
        if (sensor.name == lens.camera_name) lens.camera = sensor.id;
        cameras += (cameras.empty() ? "" : ", ") + sensor.name;
      }
      if (lens.camera == kSystemSensor)
        return not_allowed(fmt::format("head.lenses[{}].camera", i), "'" + lens.camera_name + "'",
                           "one of: " + cameras);
    }
    // Only the regions of lenses that the head has are decoded.
    for (const SensorKeys& one : sensors) {
      if (one.sensor.type->role != Role::Camera) continue;
      std::vector<PixelRegion> regions;
      for (const fusion::LensMount& lens : head->lenses)
        if (lens.camera == one.sensor.id)
          regions.push_back({lens.x_offset, lens.y_offset, lens.intrinsics.width, lens.intrinsics.height});
      dynamic_cast<drivers::CameraDevice&>(*one.device).use_only(regions);
    }
    rig.geometry.head = std::move(*head);
    return {};
  }

  /// Removes the logs of receivers from the sources of the clocks. A log does not tell when its bytes arrived, so the
  /// clocks must be learnt from the other sensors. If all sensors are files, there is nothing to learn, and each
  /// device's own clock is used.
  void untie_from_log() {
    std::vector<SensorId> others{kSystemSensor};  // nobody, because an empty list would mean everybody
    bool has_log = false;
    rig.sync.self_timed = true;
    for (const Sensor& sensor : rig.sensors) {
      const Arrivals arrivals = sensor.device->arrivals();
      rig.sync.self_timed &= arrivals != Arrivals::Live;
      has_log |= arrivals == Arrivals::Unknown;
      if (arrivals != Arrivals::Unknown) others.push_back(sensor.id);
    }
    if (!has_log) return;
    rig.sync.clock.label.trusted = kSystemSensor;
    rig.sync.label_sources = rig.sync.arrival_sources = others;
  }
};

}  // namespace

std::vector<std::string> Rig::sensor_names() const {
  std::vector<std::string> names{"hueline"};
  for (const Sensor& sensor : sensors) names.push_back(sensor.name);
  return names;
}

Rig parse_rig(const std::string& text, const std::string& name, drivers::DeviceTypes types) {
  Section root = Section::load_text(text, name);
  RigKeys keys{types};
  read_keys(root, {[&](Keys& reader) { keys.visit(reader); },
                   [&] {
                     root.finish();
                     return keys.complete();
                   }});
  keys.rig.text = text;
  return std::move(keys.rig);
}

Rig load_rig(const std::string& path, drivers::DeviceTypes types) {
  const std::string named = configuration_named(path, "rigs");
  return parse_rig(read_configuration(named), named, types);
}

void visit_rig_keys(Keys& keys, drivers::DeviceTypes types) { RigKeys{types}.visit(keys); }

}  // namespace hueline::config
