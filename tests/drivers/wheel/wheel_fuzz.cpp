#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "drivers/can/blf.hpp"
#include "drivers/can/can_log.hpp"
#include "drivers/can/dbc.hpp"
#include "drivers/wheel/wheel_decoder.hpp"
#include "drivers/xsens/xsens_can_decoder.hpp"

namespace {

/// Reads the bytes as a binary log, behind its header and in a container.
void read_blf(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  const int fd = ::memfd_create("log", MFD_CLOEXEC);
  if (fd < 0) std::abort();
  const std::array<std::uint8_t, 8> head{'L', 'O', 'G', 'G', 8, 0, 0, 0};
  std::vector<std::uint8_t> container{'L', 'O', 'B', 'J', 16, 0, 1, 0, 0, 0, 0, 0, 10};
  container.resize(32);
  for (std::size_t i = 0; i < 4; ++i) container[8 + i] = static_cast<std::uint8_t>((32 + size) >> (8 * i));
  if (::write(fd, head.data(), head.size()) < 0 || ::write(fd, container.data(), container.size()) < 0 ||
      ::write(fd, data, size) < 0 || ::write(fd, data, size) < 0)
    std::abort();
  auto file = InputFile::open("/proc/self/fd/" + std::to_string(fd));
  if (!file.ok()) std::abort();
  drivers::BlfReader log(std::move(*file));
  // Each call takes a byte of the log at least.
  for (std::size_t calls = 0;; ++calls) {
    if (calls > 3 * size + 100) std::abort();
    const auto entry = log.next();
    if (entry.ok() && !*entry) break;
    if (entry.ok() && (*entry)->frame.length > drivers::kCanDataMost) std::abort();
  }
  ::close(fd);
}

}  // namespace

// Packets of random lengths, unchanged or made into one of the two kinds, so that what follows their headers is
// reached. The same bytes are also read as text of a log, as a binary log and as a DBC file. Whatever comes, every byte
// is counted exactly once.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  drivers::WheelDecoder::Config config;
  config.messages.resize(2);
  config.messages[0].id = 1;
  config.messages[0].speeds.resize(2);
  config.messages[0].speeds[1].start_bit = 15;
  config.messages[0].speeds[1].bits = 12;
  config.messages[0].speeds[1].order = drivers::BitOrder::Big;
  config.messages[0].speeds[1].is_signed = true;
  config.messages[0].counter = drivers::CanSignal{};
  config.messages[0].counter->start_bit = 32;
  config.messages[0].counter->bits = 4;
  config.messages[1].id = 2;
  config.messages[1].pulses.push_back({drivers::CanSignal{}, 0.02});
  drivers::WheelDecoder decoder(config);
  drivers::XsensCanDecoder pos;
  std::vector<Measurement> out, of_pos;
  std::size_t given = 0;
  std::int64_t time = 0;
  for (std::size_t at = 0; at < size;) {
    const std::size_t length = std::min<std::size_t>(1 + data[at] % 96, size - at);
    std::vector<std::byte> bytes(length);
    std::transform(data + at, data + at + length, bytes.begin(),
                   [](std::uint8_t b) { return static_cast<std::byte>(b); });
    if (length > 8 && data[at + 1] % 3 == 0) {
      drivers::CanFrame frame;
      constexpr std::array<std::uint32_t, 16> kIds{1, 2, 3, 4, 5, 6, 7, 17, 33, 34, 50, 52, 113, 114, 118, 1};
      frame.id = kIds[data[at + 2] % kIds.size()];
      frame.is_error = data[at + 2] % 16 == 9;
      frame.length = static_cast<std::uint8_t>(std::min<std::size_t>(8, length - 4));
      std::copy_n(data + at + 4, frame.length, frame.data.begin());
      bytes = drivers::encode_can_packet(frame);
    } else if (length > 12 && data[at + 1] % 3 == 1) {
      const std::array<int, 10> head{2, 0, data[at + 2], 0, 1 + data[at + 3] % 3, 0, 0, 0, 1 + data[at + 4] % 2, 6};
      std::transform(head.begin(), head.end(), bytes.begin(), [](int b) { return static_cast<std::byte>(b); });
    }
    time += data[at] * 1'000'000LL;
    given += bytes.size();
    const Packet packet{.sensor = 1, .received = host_time_ns(time), .bytes = Buffer::copy_of(bytes)};
    decoder.decode(packet, out);
    pos.decode(packet, of_pos);
    at += length;
  }
  decoder.flush(out);
  pos.flush(of_pos);
  for (const DecodeCounts& counts : {decoder.counts(), pos.counts()})
    if (counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes != given) std::abort();
  for (const Measurement& m : out)
    if (const auto* wheel = std::get_if<WheelSpeed>(&m))
      if ((wheel->speed && !(std::abs(*wheel->speed) <= config.max_speed)) ||
          (wheel->distance_m && !std::isfinite(*wheel->distance_m)))
        std::abort();

  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const char* head : {"", ";$COLUMNS=N,O,T,B,I,d,R,L,D", ";$COLUMNS=O,I,T,l,D", "***BUSMASTER Ver 3***",
                           "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2", "timestamp,id,extended,error,dlc,data"}) {
    drivers::CanLogParser log;
    if (!log.take(head).ok()) std::abort();
    for (std::size_t at = 0; at < size;) {
      const std::size_t end = std::min(text.find('\n', at), size);
      const auto entry = log.take(text.substr(at, end - at));
      if (entry.ok() && *entry && (*entry)->frame.length > drivers::kCanDataMost) std::abort();
      at = end + 1;
    }
  }
  read_blf(data, size);
  const std::vector<std::uint8_t> frame(64, 0xA5);
  for (const auto& message : drivers::read_dbc(text).messages) {
    for (const auto& signal : message.signals)
      if (signal.signal.bits < 1 || signal.signal.bits > 64 || signal.signal.needed_bytes() > frame.size())
        std::abort();
    for (std::size_t bytes : {0u, 1u, 8u, 64u})
      for (const auto& value : drivers::decode(message, std::span(frame).first(bytes)))
        if (value.signal->signal.needed_bytes() > bytes) std::abort();
  }
  return 0;
}
