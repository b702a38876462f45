#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/decoder.hpp"
#include "core/packet.hpp"
#include "core/result.hpp"

/// How `hueline inspect` recognises what a device sent in files that do not name the device.
namespace hueline::drivers {

/// A device that a CaptureListener recognised.
struct HeardDevice {
  std::string name;  ///< for people: "velodyne VLP-16"
  std::unique_ptr<Decoder> decoder;
  std::string note{};         ///< what the user must know of the decoding, such as which angles are used; may be empty
  std::string description{};  ///< the file of use_description() that is used; empty: none of them
};

/// Finds the devices of one kind among the senders of a capture file. Each file that is inspected has a listener of its
/// own. Thread safety: none.
class CaptureListener {
 public:
  virtual ~CaptureListener() = default;
  /// Looks at a datagram of a sender that nobody has recognised yet. Returns the device if the datagram tells which one
  /// it is, or nothing. `sender` is the IP address as text. The decoder gets this datagram too.
  virtual std::optional<HeardDevice> listen(const Packet& datagram, const std::string& sender) = 0;
  /// Returns whether a datagram of a recognised device is one that its decoder reads. The others are only counted.
  virtual bool is_decodable(const Packet& datagram) const = 0;
  /// Gives the listener a file in which the maker or the device itself describes one device: its angles, its packets.
  /// It is called before listen(). Errors: Unsupported if the file describes no device of this kind; Malformed, Io.
  virtual Status use_description(const std::string& file) {
    return Error{ErrorCode::Unsupported, file + ": describes no device of this kind"};
  }
  /// Returns, for people, why a file of use_description() was not used for the devices that were heard. Empty: nothing
  /// is known but that it describes none of them.
  virtual std::string why_not_used(const std::string&) const { return {}; }
  /// Returns, for people, what else a device of this kind sent, if nothing came by which one is recognised, and what is
  /// missing. Empty: there is no such thing in the file.
  virtual std::string lone_packets() const { return {}; }
  /// Returns, for people, what resembles a device of this kind but is no known model of it, and which models are known.
  /// Empty: there is no such thing in the file.
  virtual std::string unknown_models() const { return {}; }
};

/// What DeviceType says of a device's files.
struct DeviceFiles {
  /// A file that holds the device's bytes and nothing else. A Device with default keys makes its decoder.
  struct Log {
    const char* format = nullptr;  ///< name of the format, for people; null: there are no such files
    const char* ending = "";       ///< of the file's name, with its dot
    /// Returns whether the first bytes of a file (up to 64 KiB) are of this format. If no device's bytes
    /// fit, the ending decides.
    bool (*is_beginning)(std::string_view first_bytes) = nullptr;
  };
  /// The device's UDP datagrams in a capture file (pcap, pcapng).
  struct Capture {
    const char* kind = nullptr;  ///< for messages, with its article: "a Velodyne"
    /// Whether the datagrams begin with a signature. Devices whose datagrams have none are asked last, because a
    /// datagram of another device may have the same size.
    bool has_signature = false;
    /// Makes a listener for the file `path`. Null: the device is not looked for in captures.
    std::unique_ptr<CaptureListener> (*listen)(const std::string& path) = nullptr;
  };
  Log log{};
  Capture capture{};
};

}  // namespace hueline::drivers
