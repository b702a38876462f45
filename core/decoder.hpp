#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/measurements.hpp"
#include "core/packet.hpp"

namespace hueline {

/// What a decoder did with the bytes that it received. Each byte is counted in exactly one of the first three members.
struct DecodeCounts {
  std::uint64_t decoded_bytes = 0;  ///< bytes of messages that became measurements
  std::uint64_t ignored_bytes = 0;  ///< bytes of well-formed messages that are not used
  /// Bytes that were skipped in search of the next message, and bytes of messages that failed their check.
  std::uint64_t malformed_bytes = 0;
  std::uint64_t malformed_messages = 0;
  /// The number of messages by the maker's name for them, ignored ones included. Use of() to change it.
  std::map<std::string, std::uint64_t> messages;

  /// Returns the counter of a message name. After kMostNames different names, which no device has, all further names
  /// are counted together as "others". This bounds the memory that noise or an attack can take.
  std::uint64_t& of(const std::string& name) {
    if (const auto known = messages.find(name); known != messages.end()) return known->second;
    return messages[messages.size() < kMostNames ? name : "others"];
  }
  static constexpr std::size_t kMostNames = 1000;
};

/// Interface of decoders, which turn bytes into measurements. A decoder uses no socket, no clock and no thread. It may
/// keep state between packets, for example a message that is split over two packets, or the previous azimuth. It
/// reports each problem as a Fault measurement when it sees it; the receiver of the measurements limits their rate. It
/// never throws because of data.
class Decoder {
 public:
  virtual ~Decoder() = default;
  /// Decodes one packet, whose kind is Wire, and appends its measurements to `out`. They are of the
  /// sensor that the packet is of.
  virtual void decode(const Packet& packet, std::vector<Measurement>& out) = 0;
  /// Ends the stream: no more bytes follow, because the recording ended or the source was opened again. Decides about
  /// bytes that were held back for a message that never became complete, and appends the whole messages behind them.
  /// Afterwards every byte is in the counts.
  virtual void flush(std::vector<Measurement>& out) { (void)out; }
  /// Forgets messages that are not complete, because the source was opened again.
  virtual void reset() = 0;
  virtual const DecodeCounts& counts() const = 0;
};

}  // namespace hueline
