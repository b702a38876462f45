#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/time.hpp"
#include "drivers/stream/message_form.hpp"
#include "drivers/stream/undecided_bytes.hpp"

namespace hueline::drivers {

/// Splits a byte stream into the messages of several forms. How the stream is cut into packets does not change what it
/// finds. A message that fails its check is searched byte by byte for the next one, so an intact message that begins
/// inside the claimed length of a broken one is found. Skipped bytes are always reported. It reads no clock.
/// Thread safety: none; one thread calls all functions.
class MessageFramer {
 public:
  /// Receives what the framer finds, in the order of the stream. Every byte belongs to exactly one call.
  class Sink {
   public:
    /// Receives a whole message. `form` is the index of its form; `received` the arrival of its last byte.
    virtual void on_message(std::size_t form, std::span<const std::byte> message, HostTime received) = 0;
    /// Receives the number of bytes that belong to no message. `messages` of them began like a message and failed their
    /// check.
    virtual void on_skipped(std::uint64_t bytes, std::uint64_t messages, HostTime received) = 0;

   protected:
    ~Sink() = default;
  };

  /// `forms` are asked in their order; the first one that finds a whole message is right.
  explicit MessageFramer(std::vector<std::unique_ptr<MessageForm>> forms) : forms_(std::move(forms)) {}

  /// Takes the next bytes of the stream; `received` is their arrival.
  void feed(std::span<const std::byte> bytes, HostTime received, Sink& sink);
  /// Ends the stream: decides about all bytes that are held back.
  void flush(Sink& sink);
  /// Ends the stream after an interruption: reports all bytes that are held back as skipped.
  void discard(Sink& sink);

 private:
  struct Found {
    Judgement judgement;
    std::size_t form = 0;
  };
  Found judge(std::span<const std::byte> rest);
  std::size_t scan(std::span<const std::byte> data, bool is_final, Sink& sink);
  void report_skipped(Sink& sink);

  std::vector<std::unique_ptr<MessageForm>> forms_;
  UndecidedBytes bytes_;
  bool is_boundary_ = true;
  std::uint64_t skipped_ = 0, broken_ = 0;
};

}  // namespace hueline::drivers
