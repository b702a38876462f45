#include "drivers/transport/usb_bulk_stream.hpp"

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <utility>

#include "drivers/transport/host_clock.hpp"
#include "drivers/transport/usb_memory.hpp"

namespace hueline::drivers {
namespace {

constexpr int kMostFailures = 5;
constexpr std::size_t kFewestTransfers = 2;

const char* what_failed(int status) {
  switch (status) {
    case LIBUSB_TRANSFER_STALL:
      return "the camera halted its endpoint on USB";
    case LIBUSB_TRANSFER_OVERFLOW:
      return "the camera sent more on USB than was asked for";
    default:
      return "a transfer on USB failed";
  }
}

}  // namespace

struct UsbBulkStream::Transfer {
  Transfer(UsbBulkStream& owner, std::size_t bytes) : stream(owner), size(bytes), usb(libusb_alloc_transfer(0)) {
    mapped = libusb_dev_mem_alloc(owner.handle_.handle(), bytes);
    if (!mapped) own.resize(bytes);
  }
  ~Transfer() {
    libusb_free_transfer(usb);
    if (mapped) libusb_dev_mem_free(stream.handle_.handle(), mapped, size);
  }
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;
  unsigned char* data() { return mapped ? mapped : own.data(); }

  UsbBulkStream& stream;
  const std::size_t size;  // the largest that it may be asked for
  libusb_transfer* const usb;
  unsigned char* mapped = nullptr;  // the kernel's memory
  std::vector<unsigned char> own;   // where the kernel gives none
};

UsbBulkStream::UsbBulkStream(UsbHandle& handle, Config config, UsbBulkReader& reader)
    : handle_(handle), config_(std::move(config)), reader_(reader) {}

Result<std::unique_ptr<UsbBulkStream>> UsbBulkStream::start(UsbHandle& handle, Config config, UsbBulkReader& reader) {
  std::unique_ptr<UsbBulkStream> out(new UsbBulkStream(handle, std::move(config), reader));
  const Config& set = out->config_;
  const auto packet = handle.packet_bytes(set.endpoint);
  if (!packet) return packet.error();
  const auto is_odd = [&](std::size_t bytes) { return bytes == 0 || bytes % *packet != 0; };
  if (set.transfer_bytes.empty() || std::ranges::any_of(set.transfer_bytes, is_odd))
    return Error{ErrorCode::Invalid, fmt::format("transfers have to be whole packets of {} bytes", *packet)};
  const std::size_t largest = *std::ranges::max_element(set.transfer_bytes);
  const std::size_t count = std::max(kFewestTransfers, set.memory_bytes / largest);
  bool has_kernels_memory = false;
  for (std::size_t i = 0; i < count; ++i) {
    auto transfer = std::make_unique<Transfer>(*out, largest);
    if (i == 0) has_kernels_memory = transfer->mapped != nullptr;
    if (has_kernels_memory && !transfer->mapped)
      return Error{ErrorCode::Unavailable, fmt::format("USB: the kernel has no memory for transfers of {} MB{}",
                                                       set.memory_bytes >> 20U, hint_at_usb_memory())};
    out->transfers_.push_back(std::move(transfer));
  }
  if (Status submitted = out->submit_all(); !submitted) return submitted.error();
  return out;
}

UsbBulkStream::~UsbBulkStream() {
  is_ending_ = true;
  cancel_all();
  while (under_way_ > 0)
    if (libusb_handle_events(handle_.context()) != 0) break;
}

Status UsbBulkStream::submit(Transfer& transfer) {
  const std::size_t bytes = config_.transfer_bytes[next_size_];
  libusb_fill_bulk_transfer(transfer.usb, handle_.handle(), config_.endpoint, transfer.data(), static_cast<int>(bytes),
                            on_end, &transfer, 0);
  if (const int failed = libusb_submit_transfer(transfer.usb); failed != 0) {
    Error error = usb_error(fmt::format("begin a transfer of {} bytes from {}", bytes, handle_.name()), failed);
    // The kernel's ENOMEM is LIBUSB_ERROR_IO, or ERROR_NO_MEM, by the version of libusb.
    if (failed != LIBUSB_ERROR_NO_DEVICE) error.message += hint_at_usb_memory();
    return error;
  }
  next_size_ = (next_size_ + 1) % config_.transfer_bytes.size();
  ++under_way_;
  return {};
}

Status UsbBulkStream::submit_all() {
  next_size_ = 0;
  for (const auto& transfer : transfers_)
    if (Status submitted = submit(*transfer); !submitted) return submitted;
  return {};
}

void UsbBulkStream::cancel_all() {
  for (const auto& transfer : transfers_) libusb_cancel_transfer(transfer->usb);
}

void UsbBulkStream::on_end(libusb_transfer* transfer) {
  auto& ended = *static_cast<Transfer*>(transfer->user_data);
  ended.stream.ended(ended);
}

void UsbBulkStream::ended(Transfer& transfer) {
  --under_way_;
  ++ends_;
  if (is_ending_) return;
  const auto size = static_cast<std::size_t>(transfer.usb->actual_length);
  // After one has failed, those behind it are dropped, because bytes are missing before them.
  if (failed_) return;
  const auto bytes = std::as_bytes(std::span(transfer.data(), size));
  if (transfer.usb->status != LIBUSB_TRANSFER_COMPLETED) {
    failed_ = transfer.usb->status;
    if (!bytes.empty()) reader_.take(bytes, false, host_now());
    cancel_all();
    return;
  }
  failures_ = 0;
  reader_.take(bytes, size < static_cast<std::size_t>(transfer.usb->length), host_now());
  if (Status submitted = submit(transfer); !submitted) broken_ = submitted.error();
}

Status UsbBulkStream::wait(std::chrono::milliseconds limit) {
  if (broken_) return *broken_;
  timeval time{static_cast<time_t>(limit.count() / 1000), static_cast<suseconds_t>(limit.count() % 1000 * 1000)};
  const std::size_t before = ends_;
  const int failed = libusb_handle_events_timeout(handle_.context(), &time);
  if (failed != 0 && failed != LIBUSB_ERROR_INTERRUPTED) return usb_error("wait for " + handle_.name(), failed);
  if (failed_ == LIBUSB_TRANSFER_NO_DEVICE || (broken_ && broken_->code == ErrorCode::Disconnected)) {
    broken_ = Error{ErrorCode::Disconnected, fmt::format("{} is unplugged", handle_.name())};
    return *broken_;
  }
  if (broken_) return *broken_;
  if (failed_ && under_way_ == 0) {
    const int status = *std::exchange(failed_, std::nullopt);
    reader_.interrupt(what_failed(status), host_now());
    if (++failures_ > kMostFailures) {
      broken_ = Error{ErrorCode::Disconnected, fmt::format("{}: {}, {} times one behind another", handle_.name(),
                                                           what_failed(status), failures_)};
      return *broken_;
    }
    const int cleared = libusb_clear_halt(handle_.handle(), config_.endpoint);
    Status again = cleared == 0 ? submit_all() : Status(usb_error("clear the halt of " + handle_.name(), cleared));
    if (!again) broken_ = again.error();
    return again;
  }
  if (ends_ == before) return Error{ErrorCode::TimedOut, {}};
  return {};
}

}  // namespace hueline::drivers
