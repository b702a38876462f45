// Any file as a capture: no crash, an end, and never more bytes out than in.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "drivers/transport/can_capture.hpp"
#include "drivers/transport/ip_extractor.hpp"
#include "drivers/transport/tcp_streams.hpp"

namespace {

/// Reads the same file as a log of a CAN bus. Each call takes a frame of the file, of 12 bytes at least.
void read_can(const std::uint8_t* data, std::size_t size) {
  using namespace hueline::drivers;
  std::FILE* stream = ::fmemopen(const_cast<std::uint8_t*>(data), size, "rb");
  if (!stream) return;
  auto file = CaptureFile::from_stream(stream, "fuzz");
  if (!file.ok()) return;
  CanCapture log(std::move(*file), "fuzz");
  for (std::size_t calls = 0;; ++calls) {
    if (calls > size) std::abort();
    const auto entry = log.next();
    if (entry.ok() && !*entry) return;
    if (entry.ok() && (*entry)->frame.length > kCanDataMost) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  using namespace hueline::drivers;
  if (size == 0) return 0;  // fmemopen takes no empty buffer
  read_can(data, size);
  std::FILE* stream = ::fmemopen(const_cast<std::uint8_t*>(data), size, "rb");
  if (!stream) return 0;
  Result<CaptureFile> file = CaptureFile::from_stream(stream, "fuzz");
  if (!file) return 0;
  IpExtractor extractor;
  TcpStreams streams;
  std::size_t captured = 0, delivered = 0, frames = 0;
  unsigned sum = 0;
  const auto take_pieces = [&] {
    while (const auto piece = streams.next()) {
      delivered += piece->bytes.size();
      if (piece->missing > 0 && !piece->is_interrupted) std::abort();
    }
  };
  for (Result<CaptureFrame> frame = file->next(); frame.ok(); frame = file->next()) {
    ++frames;
    captured += frame->bytes.size();
    if (const auto datagram = extractor.extract(*frame)) {
      delivered += datagram->payload.size();
      for (const std::byte byte : datagram->payload) sum += static_cast<unsigned>(byte);  // every byte is readable
    }
    if (const auto& segment = extractor.segment()) streams.take(*segment, HostTime(frame->time));
    take_pieces();
  }
  streams.finish();
  take_pieces();
  extractor.finish();
  const ExtractCounts& c = extractor.counts();
  if (captured > size || delivered > captured || c.datagrams > frames) std::abort();
  return sum == 0xFFFFFFFF ? 1 : 0;
}
