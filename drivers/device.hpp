#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/buffer.hpp"
#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "core/packet.hpp"

/// What a rig knows of a device. Each kind of device has a DeviceType in its own folder and a line in
/// drivers/registry.cpp; nothing outside drivers/ names a kind.
namespace hueline::drivers {

/// What a device is for. sync/ and fusion/ know roles and measurements, never kinds of devices.
enum class Role : std::uint8_t {
  Laser,     ///< gives LaserBatch; has a mounting
  Camera,    ///< gives Image; its DeviceType makes a CameraDevice
  Pos,       ///< gives InsSolution and TimeLabel; a rig has one at most
  Pps,       ///< gives PpsEdge; a rig has one at most
  Odometer,  ///< gives WheelSpeed; its DeviceType makes an OdometerDevice
};

/// Whose clock the time stamps `received` of a device's packets are of.
enum class Arrivals : std::uint8_t {
  Live,      ///< this computer's, as the packets come
  Recorded,  ///< that of the computer that made the capture file
  Unknown,   ///< none: a log of bytes
};

/// A device as a rig file describes it: all its keys but those that its role has. Immutable once it is read; then
/// thread-safe.
class Device {
 public:
  virtual ~Device() = default;

  virtual void visit(Keys& keys) = 0;
  /// Called after visit() has read a file.
  virtual KeyError validate() const = 0;

  virtual Arrivals arrivals() const { return Arrivals::Live; }
  /// The source of its packets, not opened yet.
  virtual std::unique_ptr<PacketSource> make_source(SensorId sensor, const BufferPool& pool) const = 0;
  /// Its decoder, the same live, in replay and in `inspect`.
  virtual std::unique_ptr<Decoder> make_decoder(SensorId sensor) const = 0;
};

/// A device with Role::Camera.
class CameraDevice : public Device {
 public:
  virtual nanoseconds exposure() const = 0;
  /// The pixel format of the packets, which need not be the images'.
  virtual PixelFormat sent_format() const = 0;
  /// Nobody wants the pixels outside these regions: they need not be decoded.
  virtual void use_only(const std::vector<PixelRegion>& regions) = 0;
};

/// A device with Role::Odometer.
class OdometerDevice : public Device {
 public:
  /// Whether its packets are datagrams of a CAN-to-Ethernet gateway.
  virtual bool is_by_gateway() const = 0;
};

/// The descriptor of a kind of device.
struct DeviceType {
  const char* word;  ///< of the key `driver`
  Role role;
  /// Whether its packets may be left out of fusion when that cannot keep up. What the clocks and the trajectory need
  /// may not.
  bool is_sheddable;
  std::shared_ptr<Device> (*make)();

  /// Of Role::Laser.
  struct Laser {
    nanoseconds latency_min{
        std::chrono::microseconds(1500)};  ///< from a packet's first firing to its arrival, at its fastest
    std::size_t pending_limit = 8192;      ///< packets that may wait for the scanner's clock
  };
  Laser laser{};
};

using DeviceTypes = std::span<const DeviceType* const>;

/// All kinds of devices that the program knows.
DeviceTypes device_types();

template <class T>
std::shared_ptr<Device> make_device() {
  return std::make_shared<T>();
}

}  // namespace hueline::drivers
