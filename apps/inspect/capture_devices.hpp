#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/transport/pcap_source.hpp"

namespace hueline::apps {

/// A device that was recognised in a capture file.
struct CaptureDevice {
  const drivers::DeviceType* type = nullptr;
  std::string name;  ///< for people: "velodyne VLP-16"
  drivers::IpAddress address{};
  drivers::HardwareAddress card{};  ///< that sends its datagrams
  /// To which it sends the datagrams by which it was recognised; its own port if it sends by TCP.
  std::uint16_t port = 0;
  std::optional<drivers::TcpFlow> stream;  ///< the connection by which it sends; nothing: it sends datagrams
  std::unique_ptr<Decoder> decoder;
  std::string note;         ///< what the user must know of the decoding; may be empty
  std::string description;  ///< the file of use_description() by which it is decoded; empty: none of them
};

/// Tells the devices in a capture file apart and recognises them from their datagrams, or from the first 64 KiB of what
/// they send by TCP. Of a TCP connection the side with the lower port is the device, because devices are servers. A
/// device is a sender's address;
/// several devices may share one, as in captures of a computer that played recordings: they differ in kind, or send to
/// other ports; scanners that have the address that they came with differ in their network cards.
/// Thread safety: none; one thread calls all functions.
class CaptureDevices {
 public:
  /// Looks for devices of `types` in the capture file `path`.
  CaptureDevices(const std::string& path, drivers::DeviceTypes types);

  /// Gives every kind of device the file of one device's description (CaptureListener::use_description). Errors:
  /// Unsupported if no kind of device knows such files; Malformed, Io.
  Status use_description(const std::string& file);

  /// Returns, for people, why a file of use_description() was not used; empty: it describes none of the devices, and
  /// nothing more is known.
  std::string why_not_used(const std::string& file) const;

  /// Takes a packet, or a fault packet about a stream, that `source` has just given. If a known device sent it, decodes
  /// it, appends the measurements to `out` and returns the device, otherwise returns null. The pointer is valid as long
  /// as this object. The first packets of a stream are decoded together, when the device is recognised.
  CaptureDevice* take(const Packet& packet, const drivers::PcapSource& source, std::vector<Measurement>& out);
  /// Decodes what is left after the last packet. Calls `take` once for each device, with its last measurements.
  void finish(const std::function<void(CaptureDevice& device, std::vector<Measurement>& measured)>& take);

  const std::deque<CaptureDevice>& devices() const { return devices_; }
  /// Returns, for people, what resembles a known device but is none, and which are known. Empty: there is no such
  /// thing.
  std::string unknown_models() const;
  /// Returns, for people, packets that known kinds of devices sent without those by which a device is recognised.
  /// Empty: there are none.
  std::string lone_packets() const;
  /// Returns why nothing of a capture with so many packets was decoded.
  std::string why_undecoded(std::uint64_t packets) const;
  /// What a sender sent to one port that belongs to no device.
  struct Stranger {
    std::uint64_t datagrams = 0, bytes = 0;
    /// The first datagrams. They are the device's if it is recognised later: a scanner that spins up sends its status
    /// before its first points.
    std::vector<std::pair<drivers::HardwareAddress, Packet>> first{};
    std::uint64_t first_bytes = 0;
  };
  using Strangers = std::map<std::pair<drivers::IpAddress, std::uint16_t>, Stranger>;
  /// Returns the datagrams, and the pieces of streams, that belong to no device. Their senders are bounded in number.
  const Strangers& strangers() const { return strangers_; }

 private:
  /// A kind of device that may be heard in a capture, and what listens for it.
  struct Listening {
    const drivers::DeviceType* type;
    std::unique_ptr<drivers::CaptureListener> listener;
  };
  /// A stream of which no device is known yet.
  struct Unknown {
    std::vector<Packet> packets;  // its beginning
    std::size_t bytes = 0, judged_bytes = 0;
    bool is_given_up = false;
  };
  CaptureDevice* find(const Packet& datagram, const drivers::PcapSource& source, std::vector<Measurement>& out);
  std::string strangers_in_words() const;
  void decode_what_came_before(CaptureDevice& device, std::vector<Measurement>& out);
  CaptureDevice* find(const drivers::TcpFlow& stream);
  CaptureDevice* take_stream(const Packet& packet, const drivers::TcpFlow& stream, std::vector<Measurement>& out);
  CaptureDevice* recognise(const drivers::TcpFlow& stream, Unknown& unknown);
  Stranger* count_stranger(const Packet& packet, const drivers::IpAddress& sender, std::uint16_t port);
  CaptureDevice* recognise(const Packet& datagram, const drivers::PcapSource& source, const drivers::DeviceType* only);
  const drivers::CaptureListener& listener_of(const drivers::DeviceType* type) const;

  std::vector<Listening> listening_;  // those whose datagrams have a signature come first
  drivers::DeviceTypes types_;
  std::deque<CaptureDevice> devices_;
  std::map<drivers::TcpFlow, Unknown> unknown_;
  Strangers strangers_;
};

}  // namespace hueline::apps
