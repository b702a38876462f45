#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/measurements.hpp"
#include "core/packet.hpp"

namespace hueline {

/// What a decoder did with the bytes it was given. Every byte is counted in exactly one of the three.
struct DecodeCounts {
  std::uint64_t decoded_bytes = 0;    ///< inside messages that became measurements
  std::uint64_t ignored_bytes = 0;    ///< well-formed messages that we do not use
  std::uint64_t malformed_bytes = 0;  ///< skipped while looking for the next message, or failing their check
  std::uint64_t malformed_messages = 0;
  std::map<std::string, std::uint64_t>
      messages;  ///< by the maker's name for them, ignored ones included; change it by of()

  /// The count of a name. No device has more than kMostNames kinds of messages: what comes under further ones, noise
  /// that passes for whole or an attack, is counted together, under "others".
  std::uint64_t& of(const std::string& name) {
    if (const auto known = messages.find(name); known != messages.end()) return known->second;
    return messages[messages.size() < kMostNames ? name : "others"];
  }
  static constexpr std::size_t kMostNames = 1000;
};

/// Bytes in, values out: no socket, no clock, no thread. May keep state between packets (a message split over two
/// packets, the previous azimuth). Reports each trouble as a Fault measurement when it sees it: who takes the
/// measurements bounds their rate. Never throws on data.
class Decoder {
 public:
  virtual ~Decoder() = default;
  /// Appends to `out`. `packet.kind` is Wire.
  virtual void decode(const Packet& packet, std::vector<Measurement>& out) = 0;
  /// No more bytes will come (end of a recording, or the source was reopened): decides about bytes held back for a
  /// message that never completed, and appends what stood whole behind them. After it every byte is in the counts.
  virtual void flush(std::vector<Measurement>& out) { (void)out; }
  /// The source was reopened: forget half messages.
  virtual void reset() = 0;
  virtual const DecodeCounts& counts() const = 0;
};

}  // namespace hueline
