#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "core/time.hpp"

namespace hueline::drivers {

/// The end of a byte stream about which a framer has not decided yet, and when bytes came. `scan` is always a function
/// of the framer that takes the undecided bytes, calls decided() while it goes over them, and returns how many of them
/// it has decided. Thread safety: none; one framer uses it.
class UndecidedBytes {
 public:
  /// Takes the next bytes of the stream, whose arrival is `received`, and lets `scan` decide.
  template <class Scan>
  void feed(std::span<const std::byte> bytes, HostTime received, Scan scan) {
    if (bytes.empty()) return;
    fed_ += bytes.size();
    arrivals_.push_back({fed_, received});
    if (size() == 0) {
      const std::size_t done = scan(bytes);
      held_.assign(bytes.begin() + static_cast<std::ptrdiff_t>(done), bytes.end());
      done_ = 0;
      return;
    }
    held_.insert(held_.end(), bytes.begin(), bytes.end());
    done_ += scan(std::span<const std::byte>(held_).subspan(done_));
    // The rest is moved only when more than half is done, so that moving costs little for each byte.
    if (done_ > held_.size() / 2) {
      held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(done_));
      done_ = 0;
    }
  }
  /// Ends the stream: `scan` decides about all bytes.
  template <class Scan>
  void flush(Scan scan) {
    scan(std::span<const std::byte>(held_).subspan(done_));
    held_.clear();
    done_ = 0;
  }
  /// Ends the stream after an interruption: nothing of the bytes is wanted. Returns their number.
  std::size_t discard() {
    const std::size_t bytes = size();
    decided(bytes);
    held_.clear();
    done_ = 0;
    return bytes;
  }

  /// The framer has decided about the next bytes.
  void decided(std::size_t bytes) { position_ += bytes; }
  /// Returns the position in the stream of the next undecided byte.
  std::uint64_t position() const { return position_; }
  /// Returns the arrival of the last byte that was decided.
  HostTime received_of_last() {
    // Bytes are decided in their order, so the arrivals of earlier bytes are not needed again.
    while (arrivals_.size() > 1 && arrivals_.front().end < position_) arrivals_.pop_front();
    return arrivals_.empty() ? HostTime{} : arrivals_.front().received;
  }
  /// Returns the number of bytes that are held back. It is right between the calls of feed() and flush().
  std::size_t size() const { return held_.size() - done_; }

 private:
  struct Arrival {
    std::uint64_t end;  // stream position after its last byte
    HostTime received;
  };

  std::vector<std::byte> held_;
  std::size_t done_ = 0;  // bytes at the front of held_ that are decided
  std::deque<Arrival> arrivals_;
  std::uint64_t position_ = 0;
  std::uint64_t fed_ = 0;
};

}  // namespace hueline::drivers
