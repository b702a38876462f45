#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"
#include "drivers/transport/usb_handle.hpp"

struct libusb_transfer;

namespace hueline::drivers {

/// Takes what a bulk endpoint gives.
class UsbBulkReader {
 public:
  virtual ~UsbBulkReader() = default;
  /// The bytes of one transfer, which begin with a packet; they are valid during the call. `is_short`: the transfer
  /// ended with a packet that is shorter than the others, or empty.
  virtual void take(std::span<const std::byte> bytes, bool is_short, HostTime received) = 0;
  /// Bytes are missing here, because a transfer failed. `why` says how.
  virtual void interrupt(std::string_view why, HostTime at) = 0;
};

/// Reads a bulk endpoint with many transfers under way at a time, so that the host controller always has one to fill
/// while this program is busy. Their memory is the kernel's where it gives it to programs (libusb_dev_mem_alloc), so
/// the bytes are copied once, by the reader. After a transfer that failed, such as by a halt of the endpoint, the halt
/// is cleared and the stream goes on.
///
/// Thread safety: none; one thread calls all functions. The handle and the reader have to outlive the stream.
class UsbBulkStream {
 public:
  struct Config {
    std::uint8_t endpoint = 0x81;
    /// The sizes of the transfers, bytes, multiples of the packet size. They are asked for in this order, again and
    /// again, so that one transfer can end where what the device sends at a time does.
    std::vector<std::size_t> transfer_bytes;
    std::size_t memory_bytes = 8u << 20;  ///< of all transfers together; there are always at least two
  };
  /// Begins to read. Errors: Unavailable (the kernel has no memory for the transfers), Disconnected, Io.
  static Result<std::unique_ptr<UsbBulkStream>> start(UsbHandle& handle, Config config, UsbBulkReader& reader);
  /// Ends the transfers. What they had received is dropped.
  ~UsbBulkStream();
  UsbBulkStream(const UsbBulkStream&) = delete;
  UsbBulkStream& operator=(const UsbBulkStream&) = delete;

  /// Waits until at least one transfer has ended and gives its bytes to the reader. Errors: TimedOut, Disconnected (the
  /// device is unplugged, or its transfers fail again and again), Unavailable (no memory), Io.
  Status wait(std::chrono::milliseconds limit);

 private:
  struct Transfer;
  UsbBulkStream(UsbHandle& handle, Config config, UsbBulkReader& reader);
  Status submit(Transfer& transfer);
  Status submit_all();
  void cancel_all();
  void ended(Transfer& transfer);
  static void on_end(libusb_transfer* transfer);

  UsbHandle& handle_;
  const Config config_;
  UsbBulkReader& reader_;
  std::vector<std::unique_ptr<Transfer>> transfers_;
  std::size_t next_size_ = 0;  // place in Config::transfer_bytes
  std::size_t under_way_ = 0, ends_ = 0;
  bool is_ending_ = false;       // transfers are not submitted again
  std::optional<int> failed_;    // status of the first transfer that failed
  std::optional<Error> broken_;  // why the stream cannot go on
  int failures_ = 0;             // one behind another, without a byte between them
};

}  // namespace hueline::drivers
