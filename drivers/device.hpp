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
#include "core/pixel_rows.hpp"
#include "drivers/device_files.hpp"

/// The interface between a rig and its devices. Each kind of device has a DeviceType in its own folder and one line in
/// drivers/registry.cpp. No code outside drivers/ names a kind of device.
namespace hueline::drivers {

/// What a device is for. sync/ and fusion/ distinguish roles and measurements, never kinds of devices.
enum class Role : std::uint8_t {
  Laser,     ///< gives LaserBatch; has a mounting
  Camera,    ///< gives Image; its DeviceType makes a CameraDevice
  Pos,       ///< gives InsSolution and TimeLabel; at most one in a rig
  Pps,       ///< gives PpsEdge; its DeviceType makes a PulseDevice; at most one in a rig
  Odometer,  ///< gives WheelSpeed; its DeviceType makes an OdometerDevice
};

/// Whose clock stamped the arrival (`Packet::received`) of a device's packets.
enum class Arrivals : std::uint8_t {
  Live,      ///< the clock of this computer, when the packet came
  Recorded,  ///< the clock of the computer that made the capture file
  Unknown,   ///< no clock: the source is a file of bytes that has no arrival times
};

/// A device as a rig file describes it. It holds all keys of the device except those that belong to its role (such as
/// the mounting of a laser). Thread safety: immutable after the rig file is read, and thread-safe from then on.
class Device {
 public:
  virtual ~Device() = default;

  /// Declares the device's keys (core/keys.hpp).
  virtual void visit(Keys& keys) = 0;
  /// Checks the rules that concern several keys. It is called after visit() has read a file.
  virtual KeyError validate() const = 0;

  /// Returns whose clock stamps the arrivals of the packets of make_source().
  virtual Arrivals arrivals() const { return Arrivals::Live; }
  /// Makes the source of the device's packets. The source is not opened yet.
  virtual std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const = 0;
  /// Makes the device's decoder. Live capture, replay and `inspect` use the same decoder.
  virtual std::unique_ptr<Decoder> make_decoder() const = 0;
};

/// A device with Role::Camera.
class CameraDevice : public Device {
 public:
  /// Returns the exposure time that the rig sets, or 0 if the rig leaves it to the camera.
  virtual nanoseconds exposure() const = 0;
  /// Returns whether the camera chooses its exposures, so that nothing but its report tells how long an image was
  /// exposed.
  virtual bool must_report() const { return false; }
  /// Returns the pixel format of the packets. It may differ from the pixel format of the images that the decoder makes.
  virtual PixelFormat sent_format() const = 0;
  /// Returns where the samples of a packet's image lie; no rows if the packet has no uncompressed image.
  virtual PixelRows pixel_rows(std::span<const std::byte> /*packet*/) const { return {}; }
  /// Names the regions of the image whose pixels are used. The decoder may leave out the rest.
  virtual void use_only(const std::vector<PixelRegion>& regions) = 0;
};

/// A device with Role::Pps.
class PulseDevice : public Device {
 public:
  /// Returns whether it also names its seconds (TimeLabel).
  virtual bool names_seconds() const = 0;
};

/// A device with Role::Odometer.
class OdometerDevice : public Device {
 public:
  /// Returns whether the packets are datagrams of a CAN-to-Ethernet gateway.
  virtual bool is_by_gateway() const = 0;
};

/// The descriptor of one kind of device.
struct DeviceType {
  const char* word;  ///< value of the key `driver` in a rig file
  Role role;
  /// Whether packets may be left out of fusion when fusion is too slow. It is false for packets that the clocks or the
  /// trajectory need.
  bool is_sheddable;
  std::shared_ptr<Device> (*make)();  ///< makes a device with the default values of its keys

  /// What sync/ takes for given about a scanner. It is used for Role::Laser only.
  struct Laser {
    /// Shortest time from the first firing of a packet to the arrival of the packet.
    nanoseconds latency_min{std::chrono::microseconds(1500)};
    std::size_t pending_limit = 8192;  ///< largest number of packets that wait for the scanner's clock
  };
  Laser laser{};
  /// How `inspect` recognises its files.
  DeviceFiles files{};
  /// Which messages of a POS make navigation solutions, in the maker's words, to end the sentence "a navigation
  /// solution is". It is used for Role::Pos only.
  const char* solutions = "";
};

using DeviceTypes = std::span<const DeviceType* const>;

/// Returns all kinds of devices that the program knows, in the order of drivers/registry.cpp.
DeviceTypes device_types();

/// Makes a device of class T. Use it as DeviceType::make.
template <class T>
std::shared_ptr<Device> make_device() {
  return std::make_shared<T>();
}

}  // namespace hueline::drivers
