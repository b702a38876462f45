#include <algorithm>
#include <array>
#include <cstdlib>
#include <span>
#include <utility>

#include "drivers/pps/pps_decoder.hpp"
#include "drivers/pps/ptp_decoder.hpp"

// One input is a run of messages of 24 bytes and a rest. Noise seldom begins with the magic, so every second message
// gets it and a small edge number. Whatever comes, every byte is counted exactly once.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  drivers::PpsDecoder decoder({});
  drivers::PtpDecoder ptp(drivers::PtpScale::Tai);
  std::vector<Measurement> out;
  for (std::size_t at = 0; at < size; at += drivers::kPpsPacketSize) {
    std::array<std::uint8_t, drivers::kPpsPacketSize> message{};
    const std::size_t length = std::min(message.size(), size - at);
    std::copy_n(data + at, length, message.begin());
    if (at / drivers::kPpsPacketSize % 2 == 0) {
      const auto head = drivers::encode_pps({.sequence = message[9]});
      std::copy_n(reinterpret_cast<const std::uint8_t*>(head.data()), 16, message.begin());
      message[4] = message[5] % 4U;
      message[5] = 0;
    }
    decoder.decode({.sensor = 1, .bytes = Buffer::copy_of(std::as_bytes(std::span(message).first(length)))}, out);
  }
  // The same as readings of a PTP clock, whose bytes behind the magic are noise.
  std::size_t of_ptp = 0;
  for (std::size_t at = 0; at < size; at += drivers::kPtpPacketSize) {
    std::array<std::uint8_t, drivers::kPtpPacketSize> message{'P', 'T', 'P', '1'};
    const std::size_t length = std::min(message.size(), size - at);
    if (length > 4) std::copy_n(data + at + 4, length - 4, message.begin() + 4);
    of_ptp += length;
    ptp.decode({.sensor = 1, .bytes = Buffer::copy_of(std::as_bytes(std::span(message).first(length)))}, out);
  }
  for (const auto& [counts, given] : {std::pair(decoder.counts(), size), std::pair(ptp.counts(), of_ptp)})
    if (counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes != given) std::abort();
  return 0;
}
