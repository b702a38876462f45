#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/transport/udp_extractor.hpp"

namespace hueline::apps {

/// A device that was recognised in a capture file.
struct CaptureDevice {
  const drivers::DeviceType* type = nullptr;
  std::string name;  ///< for people: "velodyne VLP-16"
  drivers::IpAddress address{};
  std::uint16_t port = 0;  ///< to which it sends the datagrams by which it was recognised
  std::unique_ptr<Decoder> decoder;
  std::string note;  ///< what the user must know of the decoding; may be empty
};

/// Tells the devices in a capture file apart and recognises them from their datagrams. A device is a sender's address;
/// several devices may share one, as in captures of a computer that played recordings: they differ in kind, or send to
/// other ports.
/// Thread safety: none; one thread calls all functions.
class CaptureDevices {
 public:
  /// Looks for devices of `types` in the capture file `path`.
  CaptureDevices(const std::string& path, drivers::DeviceTypes types);

  /// Gives every kind of device the file of one device's description (CaptureListener::use_description). Errors:
  /// Unsupported if no kind of device knows such files; Malformed, Io.
  Status use_description(const std::string& file);

  /// Returns the device whose decoder reads this datagram, or null if no device is known that does. The pointer is
  /// valid as long as this object.
  CaptureDevice* find(const Packet& datagram, const drivers::IpAddress& sender, std::uint16_t port);

  const std::deque<CaptureDevice>& devices() const { return devices_; }
  /// Returns, for people, what resembles a known device but is none, and which are known. Empty: there is no such
  /// thing.
  std::string unknown_models() const;
  /// Returns why nothing of a capture with so many datagrams was decoded.
  std::string why_undecoded(std::uint64_t datagrams) const;
  /// What a sender sent to one port that belongs to no device.
  struct Stranger {
    std::uint64_t datagrams = 0, bytes = 0;
  };
  using Strangers = std::map<std::pair<drivers::IpAddress, std::uint16_t>, Stranger>;
  /// Returns the datagrams that belong to no device. Their senders are bounded in number.
  const Strangers& strangers() const { return strangers_; }

 private:
  /// A kind of device that may be heard in a capture, and what listens for it.
  struct Listening {
    const drivers::DeviceType* type;
    std::unique_ptr<drivers::CaptureListener> listener;
  };
  CaptureDevice* recognise(const Packet& datagram, const drivers::IpAddress& sender, std::uint16_t port,
                           const drivers::DeviceType* only);
  const drivers::CaptureListener& listener_of(const drivers::DeviceType* type) const;

  std::vector<Listening> listening_;  // those whose datagrams have a signature come first
  std::deque<CaptureDevice> devices_;
  Strangers strangers_;
};

}  // namespace hueline::apps
