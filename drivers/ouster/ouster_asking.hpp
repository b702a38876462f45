#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/packet.hpp"
#include "drivers/transport/text_exchange.hpp"

namespace hueline::drivers {

/// A source that asks an Ouster for its metadata and its time beside receiving its datagrams, and delivers what it
/// answers as packets: the metadata when they differ from those delivered last, the time once a second. It asks by
/// HTTP; firmware before 2.1, which has no page of metadata, by the text commands of its TCP port, whose answers are
/// put together as that page has them. So the journal holds what the decoder needs. The datagrams never wait for an
/// answer.
///
/// Fault packets beside those of the datagrams: Refused, each time that the scanner cannot be asked.
/// Thread safety: none; one thread calls all functions.
class OusterAskingSource final : public PacketSource {
 public:
  struct Config {
    std::string address;  ///< IPv4
    std::uint16_t http_port = 80, text_port = 7501;
  };
  OusterAskingSource(std::unique_ptr<PacketSource> datagrams, Config config);

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

 private:
  enum class Subject : std::uint8_t { Metadata, Time };
  void ask(HostTime now);
  void take(const Result<std::vector<std::string>>& answers, HostTime now);
  void deliver(const std::string& text, HostTime now);

  std::unique_ptr<PacketSource> datagrams_;
  Config config_;
  bool uses_text_ = false;  // asks by text commands
  Subject subject_ = Subject::Metadata;
  std::optional<TextExchange> exchange_;
  std::optional<HostTime> next_metadata_, next_time_;  // when to ask; nothing: now
  std::string metadata_;                               // delivered last
  std::deque<Packet> waiting_;
};

}  // namespace hueline::drivers
