#include "drivers/transport/stream_input.hpp"

#include <fmt/format.h>

#include "drivers/transport/file_source.hpp"

namespace hueline::drivers {

void EitherCapture::visit(Keys& keys) {
  PcapSource::Config::visit(keys);
  keys.choice({"protocol", "", "How the device sent what is read: in datagrams, or in a stream."}, protocol,
              {{"udp", PcapSource::Protocol::Udp}, {"tcp", PcapSource::Protocol::Tcp}});
}

void StreamInput::visit(Keys& keys, std::string_view log) {
  if (has_datagrams)
    keys.one_of({"tcp", "serial", "udp", "pcap", "file"});
  else if (has_can)
    keys.one_of({"tcp", "serial", "pcap", "file", "can", "cannelloni", "can_log"});
  else
    keys.one_of({"tcp", "serial", "pcap", "file"});
  keys.section({"tcp", "", "The device on the network, by TCP."}, tcp);
  keys.section({"serial", "", "The device on a serial port."}, serial);
  if (has_datagrams) {
    keys.section({"udp", "", "The device's datagrams from the network."}, udp);
    keys.section({"pcap", "", "What the device sent, in a capture file."}, pcap);
  } else {
    keys.section({"pcap", "", "A TCP connection to the device, in a capture file."}, tcp_pcap);
  }
  const std::string what =
      fmt::format("{} It does not say when its bytes arrived, so no clock of the computer can be learnt from it.", log);
  keys.text({"file", "", what}, file);
}

std::unique_ptr<PacketSource> StreamInput::make(const BufferPool& pool, const std::string& dialogue) const {
  if (!file.empty()) {
    FileSource::Config config;
    config.path = file;
    return std::make_unique<FileSource>(config);
  }
  if (udp) return std::make_unique<UdpSource>(*udp, pool);
  if (pcap) return std::make_unique<PcapSource>(*pcap);
  if (tcp_pcap) {
    PcapSource::Config config = *tcp_pcap;
    config.protocol = PcapSource::Protocol::Tcp;
    return std::make_unique<PcapSource>(config);
  }
  if (serial) {
    SerialSource::Config config = *serial;
    config.stream.dialogue = dialogue;
    return std::make_unique<SerialSource>(config);
  }
  TcpSource::Config config = tcp.value();
  config.stream.dialogue = dialogue;
  return std::make_unique<TcpSource>(config);
}

}  // namespace hueline::drivers
