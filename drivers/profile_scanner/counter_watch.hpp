#pragma once

#include <bitset>
#include <cstdint>

namespace hueline::drivers {

/// Follows a device's 32-bit counter of its datagrams, which wraps. Tells which datagrams are missing, came late or
/// came twice. A late one was reported as missing before.
/// Thread safety: none; one thread calls all functions.
class CounterWatch {
 public:
  /// How a datagram follows those before it.
  enum class Verdict : std::uint8_t {
    InOrder,  ///< the first datagram, or the next one
    Gap,      ///< `missing` datagrams before it have not come so far
    Late,     ///< older than the newest, and new
    Twice,    ///< came before
    Leap,     ///< too far from the newest for a loss: the device restarted, or the number is broken
  };
  /// The result of add(); `missing` is set for Gap.
  struct Seen {
    Verdict verdict = Verdict::InOrder;
    std::uint32_t missing = 0;
  };

  /// Takes the counter of the next datagram.
  Seen add(std::uint32_t counter) {
    if (!has_newest_) return start(counter, Verdict::InOrder);
    const std::uint32_t ahead = counter - newest_, behind = newest_ - counter;
    if (ahead >= 1 && ahead <= kFarthest) {
      for (std::uint32_t i = 1; i <= ahead && i <= kMemory; ++i) seen_.reset((newest_ + i) % kMemory);
      newest_ = counter;
      seen_.set(counter % kMemory);
      return ahead == 1 ? Seen{} : Seen{Verdict::Gap, ahead - 1};
    }
    if (behind < kMemory) {
      if (seen_.test(counter % kMemory)) return {Verdict::Twice, 0};
      seen_.set(counter % kMemory);
      return {Verdict::Late, 0};
    }
    return start(counter, Verdict::Leap);
  }
  void reset() { has_newest_ = false; }

 private:
  /// Number of counters that are remembered. A power of two, so that the wrap of the counter keeps their places. A
  /// restarted scanner is not this close.
  static constexpr std::uint32_t kMemory = 1024;
  static constexpr std::uint32_t kFarthest = 10'000'000;  ///< ten minutes of a fast scanner; a larger step is no loss

  Seen start(std::uint32_t counter, Verdict verdict) {
    has_newest_ = true;
    newest_ = counter;
    // A datagram before the first one is not missing. It counts as late when it comes, because nothing is known of it.
    seen_.reset();
    seen_.set(counter % kMemory);
    return {verdict, 0};
  }

  bool has_newest_ = false;
  std::uint32_t newest_ = 0;
  std::bitset<kMemory> seen_;
};

}  // namespace hueline::drivers
