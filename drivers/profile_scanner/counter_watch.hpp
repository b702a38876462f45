#pragma once

#include <bitset>
#include <cstdint>

namespace hueline::drivers {

/// Follows a device's 32-bit count of its datagrams, which wraps: which are missing, which came late, which came twice.
/// A late one was told as missing before. Thread-bound.
class CounterWatch {
 public:
  enum class Verdict : std::uint8_t {
    InOrder,  ///< the first, or the next one
    Gap,      ///< `missing` before it did not come (yet)
    Late,     ///< older than the newest, and not seen before
    Twice,    ///< seen before
    Leap,     ///< too far from the newest for a loss: the device restarted, or the number is broken
  };
  struct Seen {
    Verdict verdict = Verdict::InOrder;
    std::uint32_t missing = 0;
  };

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
  static constexpr std::uint32_t kMemory =
      1024;  ///< a power of two: the wrap of the count keeps places; a scanner does not restart within so few
  static constexpr std::uint32_t kFarthest = 10'000'000;  ///< ten minutes of a fast scanner; farther is no loss

  Seen start(std::uint32_t counter, Verdict verdict) {
    has_newest_ = true;
    newest_ = counter;
    // What came before the first is not missing, and cannot be told from what comes twice: it counts as late once.
    seen_.reset();
    seen_.set(counter % kMemory);
    return {verdict, 0};
  }

  bool has_newest_ = false;
  std::uint32_t newest_ = 0;
  std::bitset<kMemory> seen_;
};

}  // namespace hueline::drivers
