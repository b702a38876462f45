#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "drivers/novatel/overlapping_crc.hpp"
#include "drivers/novatel/wire.hpp"
#include "drivers/stream/undecided_bytes.hpp"

namespace hueline::drivers {

/// Splits the byte stream of a receiver into messages: OEM7 binary with long or short header, mixed with text (answers
/// `<OK`, prompts `[COM1]`, ASCII logs). It does not interpret messages. How the stream is cut into packets does not
/// change what it finds. It reads no clock.
/// Thread safety: none; one thread calls all functions.
///
/// A message is valid if its CRC holds. If not, the search goes on one byte after its first byte, so an intact message
/// that begins inside the claimed length of a broken one is found. Skipped bytes are always reported. Text is
/// recognised only where it can stand: directly after a message or other text, or at the beginning of a line. Printable
/// bytes elsewhere belong to what is broken.
///
/// The work is proportional to the number of bytes, whatever they are and however they are cut: overlapping messages
/// are hashed only once (OverlappingCrc).
class NovatelFramer {
 public:
  struct Config {
    /// Longest message that is accepted, bytes; a header that claims more counts as noise. It limits how long a
    /// corrupted length can hold back what follows.
    std::size_t max_message_bytes = 32768;
    /// Returns an empty text if all values are allowed, else what is wrong.
    std::string validate() const;
  };

  /// Receives what the framer finds, in the order of the stream. Every byte belongs to exactly one call.
  class Sink {
   public:
    /// Receives a message whose CRC holds.
    virtual void on_message(const NovatelMessage& message) = 0;
    /// Receives one line with its line end, or a piece of a line that is too long.
    virtual void on_text(std::string_view text, HostTime received) = 0;
    /// Receives the number of bytes that belong to no message and no text. `messages` of them began like a message and
    /// failed their check; `first_id` is the id of the first one.
    virtual void on_skipped(std::uint64_t bytes, std::uint64_t messages, std::uint16_t first_id, HostTime received) = 0;

   protected:
    ~Sink() = default;
  };

  explicit NovatelFramer(Config config) : config_(config) {}

  /// Takes the next bytes of the stream; `received` is their arrival.
  void feed(std::span<const std::byte> bytes, HostTime received, Sink& sink);
  /// Ends the stream: decides about all bytes that are held back.
  void flush(Sink& sink);
  /// Ends the stream after an interruption: reports all bytes that are held back as skipped.
  void discard(Sink& sink);
  /// Returns the number of bytes that were fed but not given to the sink yet.
  std::uint64_t held_bytes() const { return bytes_.size() + skipped_; }
  /// Returns the number of bytes hashed for check sums. It is at most twice the number of bytes fed.
  std::uint64_t bytes_hashed() const { return checksums_.bytes_hashed(); }

 private:
  enum class Place : std::uint8_t { Boundary, Text, Lost };
  enum class Verdict : std::uint8_t { Message, NeedMore, Noise, Broken };

  std::size_t scan(std::span<const std::byte> data, bool is_final, Sink& sink);
  Verdict judge(std::span<const std::byte> data, NovatelMessage& message);
  bool may_start_text(std::byte byte) const;
  void skip(std::byte byte, Sink& sink);
  void report_skipped(Sink& sink);

  Config config_;
  UndecidedBytes bytes_;
  std::size_t text_seen_ = 0;  // leading bytes of the next undecided line that are known to be text
  OverlappingCrc checksums_;
  Place place_ = Place::Boundary;
  std::byte last_{}, last_but_one_{};  // the latest two of the skipped bytes
  std::uint64_t skipped_ = 0, broken_ = 0;
  std::uint16_t first_broken_id_ = 0;
};

}  // namespace hueline::drivers
