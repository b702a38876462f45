#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"

/// The live feed of a capture or replay: what goes over its local stream socket (docs/formats.md). Both sides are on
/// one computer. A frame is the length of what follows (4 bytes, little endian), a kind (1 byte) and the content.
namespace hueline::feed {

/// Name of the socket in a drive's folder.
inline constexpr const char* kSocketName = "feed";
/// Name and version of the protocol, in the feed's Hello.
inline constexpr const char* kProtocol = "hueline.feed.1";

enum class Kind : std::uint8_t {
  // From the feed.
  Hello = 1,    ///< JSON: protocol, mode, rig, drive, since, pid; once, first
  Channel = 2,  ///< JSON: id, topic, encoding, schema_name, schema_encoding, schema; once for each channel
  Message = 3,  ///< the channel's id (4 bytes), the time in ns of Unix time (8 bytes), both little endian; the message
  Answer = 4,   ///< JSON: id of the command, and error, which is empty if the command was taken
  Lost = 5,     ///< JSON: messages that this listener has lost so far because it read too slowly
  // From a listener.
  Subscribe = 65,  ///< JSON: channels, the ids of all channels that are wanted from now on
  Command = 66,    ///< JSON: id, command ("mark", "stop"), note
};

inline constexpr std::size_t kHeaderBytes = 5;
inline constexpr std::size_t kMostFromFeed = std::size_t{16} << 20;     ///< bytes of a frame from the feed
inline constexpr std::size_t kMostFromListener = std::size_t{1} << 14;  ///< bytes of a frame from a listener

/// Returns a frame.
std::string frame(Kind kind, std::string_view content);
/// Returns the frame of a message.
std::string message_frame(std::uint32_t channel, std::int64_t unix_ns, std::string_view bytes);

/// A message of the feed, as its frame holds it.
struct Message {
  std::uint32_t channel = 0;
  std::int64_t unix_ns = 0;
  std::string_view bytes;  ///< part of the frame
};
/// Reads the content of a frame of the kind Message. Empty if it is too short.
std::optional<Message> read_message(std::string_view content);

/// Cuts a stream of bytes into frames. Thread safety: none.
class FrameReader {
 public:
  struct Frame {
    Kind kind{};
    std::string content;
  };
  /// `most` is the largest frame that is accepted, bytes without the header.
  explicit FrameReader(std::size_t most) : most_(most) {}
  void add(std::string_view bytes) { bytes_.append(bytes); }
  /// Returns the next whole frame, or nothing. Error: Malformed if a frame is too large; the stream is then useless.
  Result<std::optional<Frame>> next();

 private:
  const std::size_t most_;
  std::string bytes_;
  std::size_t begin_ = 0;
};

}  // namespace hueline::feed
