// Prints the frames of a CAN log for can_log_peer_test.py, a line each: time in ns, channel, id, the letters of what
// the frame is (x 29 bits, r remote, e error, f CAN FD, l local; - for none) and its data. Exit status 1: the log is
// not read whole.
#include <cinttypes>
#include <cstdio>
#include <string>

#include "drivers/can/can_frame.hpp"
#include "drivers/transport/can_log_source.hpp"

int main(int argc, char** argv) {
  using namespace hueline;
  if (argc != 2) return 2;
  drivers::CanLogSource source({argv[1], 0});
  if (const Status opened = source.open(); !opened.ok()) {
    std::fprintf(stderr, "%s\n", opened.error().message.c_str());
    return 1;
  }
  for (;;) {
    const Result<Packet> packet = source.next({});
    if (!packet.ok()) {
      std::fprintf(stderr, "%s\n", packet.error().message.c_str());
      return packet.error().code == ErrorCode::EndOfData ? 0 : 1;
    }
    drivers::CanPacket parsed;
    if (packet->kind != PacketKind::Wire || !drivers::decode_can_packet(packet->bytes.bytes(), parsed).ok()) return 1;
    const drivers::CanFrame& frame = parsed.frames.front();
    std::string kind;
    if (frame.is_extended) kind += 'x';
    if (frame.is_remote) kind += 'r';
    if (frame.is_error) kind += 'e';
    if (frame.is_fd) kind += 'f';
    if (frame.is_local) kind += 'l';
    std::printf("%" PRId64 " %d %" PRIx32 " %s ",
                static_cast<std::int64_t>(packet->received.time_since_epoch().count()), frame.bus,
                frame.is_error ? 0 : frame.id, kind.empty() ? "-" : kind.c_str());
    if (!frame.is_error)
      for (const std::uint8_t byte : frame.bytes()) std::printf("%02x", byte);
    std::printf("\n");
  }
}
