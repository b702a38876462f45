#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string_view>

#include "drivers/transport/usb_bulk_stream.hpp"
#include "drivers/transport/usb_packet_reader.hpp"

namespace hueline::drivers {

/// The packets of a camera on USB: the transfers of its endpoint (UsbBulkStream), what puts them together, and the
/// watch over a camera that falls silent. Thread safety: none; one thread calls all functions. The handle and the
/// reader have to outlive the stream.
class UsbPacketStream final : private UsbBulkReader {
 public:
  /// Begins to read. `rate_hz`: images a second that the camera was set to, if it runs freely; 0: not known. Errors:
  /// those of UsbBulkStream::start().
  static Result<std::unique_ptr<UsbPacketStream>> start(UsbHandle& handle, UsbBulkStream::Config config,
                                                        UsbPacketReader& reader, double rate_hz, nanoseconds exposure);
  /// Waits at most 100 ms. Errors: TimedOut; Stopped; Disconnected, if the camera is unplugged, its transfers fail
  /// again and again, or nothing comes for 2 s, or for 5 periods of its rate if they are longer; at an unknown rate
  /// only after it halted its endpoint.
  Result<Packet> next(const std::stop_token& stop);

 private:
  UsbPacketStream(UsbPacketReader& reader, double rate_hz, nanoseconds exposure);
  void take(std::span<const std::byte> bytes, bool is_short, HostTime received) override;
  void interrupt(std::string_view why, HostTime at) override;
  std::optional<Error> look_for_silence() const;

  UsbPacketReader& reader_;
  const double rate_hz_;
  const nanoseconds longest_silence_;
  std::unique_ptr<UsbBulkStream> stream_;
  std::optional<HostTime> last_sign_;  // when bytes came last, or were first waited for
  bool has_halted_ = false;            // and nothing has come since
  std::optional<Error> ended_;
};

}  // namespace hueline::drivers
