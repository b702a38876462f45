#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/novatel/overlapping_crc.hpp"
#include "drivers/novatel/wire.hpp"

namespace hueline::drivers {

/// Finds messages in a byte stream: OEM7 binary with long or short header, interleaved with the receiver's text
/// (answers `<OK`, prompts `[COM1]`, ASCII logs). Knows nothing of what messages mean. Where the stream was cut into
/// packets does not change what it finds. Thread-bound; no clock.
///
/// A message counts when its CRC holds. When it does not, the search goes on one byte behind its first: an intact
/// message that begins inside the broken one's claimed length is found. Bytes passed over are reported, never dropped
/// silently. Text counts as text only where it can stand: directly behind a message or other text, or from the
/// beginning of a line; printable bytes elsewhere are part of what was broken.
///
/// The work is proportional to the bytes fed, whatever they are and wherever they were cut: lengths that nest are
/// hashed once.
class NovatelFramer {
 public:
  struct Config {
    /// A header that claims more is taken for noise. Bounds how long a corrupted length can hold back what follows.
    std::size_t max_message_bytes = 32768;
    /// Empty if fine, else what is wrong.
    std::string validate() const;
  };

  /// What the framer finds, in stream order. Every byte fed belongs to exactly one call.
  class Sink {
   public:
    virtual void on_message(const NovatelMessage& message) = 0;
    /// One line with its line end, or a piece of an over-long one.
    virtual void on_text(std::string_view text, HostTime received) = 0;
    /// `bytes` that belong to nothing, among them `messages` that began well and failed their check; the first was
    /// `first_id`.
    virtual void on_skipped(std::uint64_t bytes, std::uint64_t messages, std::uint16_t first_id, HostTime received) = 0;

   protected:
    ~Sink() = default;
  };

  explicit NovatelFramer(Config config) : config_(config) {}

  void feed(std::span<const std::byte> bytes, HostTime received, Sink& sink);
  /// The stream ended: nothing is held back any more.
  void flush(Sink& sink);
  /// The stream was cut: what is held back belongs to nothing.
  void discard(Sink& sink);
  /// Fed, but not in any call of the sink yet.
  std::uint64_t held_bytes() const { return held_.size() - decided_ + skipped_; }
  /// Work done: bytes hashed for check sums, at most two for each byte fed.
  std::uint64_t bytes_hashed() const { return checksums_.bytes_hashed(); }

 private:
  enum class Place : std::uint8_t { Boundary, Text, Lost };
  enum class Verdict : std::uint8_t { Message, NeedMore, Noise, Broken };
  struct Arrival {
    std::uint64_t end;  // stream position behind its last byte
    HostTime received;
  };

  std::size_t scan(std::span<const std::byte> data, bool is_final, Sink& sink);
  Verdict judge(std::span<const std::byte> data, NovatelMessage& message);
  bool may_start_text(std::byte byte) const;
  void skip(std::byte byte, Sink& sink);
  void report_skipped(Sink& sink);
  HostTime received_of_last();

  Config config_;
  std::vector<std::byte> held_;
  std::size_t decided_ = 0;    // bytes at the front of held_ that are done with
  std::size_t text_seen_ = 0;  // bytes of the next undecided line that are known to be text
  std::deque<Arrival> arrivals_;
  OverlappingCrc checksums_;
  std::uint64_t position_ = 0;  // of the next undecided byte in the stream
  std::uint64_t fed_ = 0;
  Place place_ = Place::Boundary;
  std::byte last_{}, last_but_one_{};  // of the skipped bytes
  std::uint64_t skipped_ = 0, broken_ = 0;
  std::uint16_t first_broken_id_ = 0;
};

}  // namespace hueline::drivers
