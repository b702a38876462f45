// Asking a scanner that is a thread of the test: by HTTP, by text commands, silent, and with a changed answer.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <functional>
#include <thread>

#include "drivers/ouster/ouster_asking.hpp"
#include "drivers/ouster/ouster_metadata.hpp"
#include "drivers/transport/file_descriptor.hpp"
#include "tests/drivers/ouster/ouster_packets.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"

namespace hueline::drivers {
namespace {

/// A TCP server on this computer. `answer` gets what came so far on a connection, and returns what to send; the
/// connection closes when it returns nothing.
class Server {
 public:
  using Answer = std::function<std::optional<std::string>(std::string& so_far)>;
  explicit Server(Answer answer) : answer_(std::move(answer)), listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(listener_.get(), reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(::listen(listener_.get(), 4), 0);
    socklen_t size = sizeof(address);
    ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::jthread([this](std::stop_token stop) { serve(stop); });
  }
  std::uint16_t port() const { return port_; }

 private:
  static bool is_ready(int fd) {
    pollfd ready{fd, POLLIN, 0};
    return ::poll(&ready, 1, 10) > 0;
  }
  void serve(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (!is_ready(listener_.get())) continue;
      const FileDescriptor peer(::accept(listener_.get(), nullptr, nullptr));
      std::string so_far;
      while (!stop.stop_requested()) {
        if (!is_ready(peer.get())) continue;
        char bytes[4096];
        const auto count = ::recv(peer.get(), bytes, sizeof bytes, 0);
        if (count <= 0) break;
        so_far.append(bytes, static_cast<std::size_t>(count));
        const auto text = answer_(so_far);
        if (!text) break;
        if (text->empty()) continue;
        (void)::send(peer.get(), text->data(), text->size(), MSG_NOSIGNAL);
        if (text->starts_with("HTTP")) break;
      }
    }
  }
  Answer answer_;
  FileDescriptor listener_;
  std::uint16_t port_ = 0;
  std::jthread thread_;
};

/// Datagrams come all the time.
class Datagrams final : public PacketSource {
 public:
  Status open() override { return {}; }
  Result<Packet> next(std::stop_token) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return test::packet_of(test::Bytes(48));
  }
  void close() override {}
};

/// Reads for so long, and returns the texts and the faults that came.
std::vector<std::string> read(OusterAskingSource& source, std::chrono::milliseconds how_long, int until = 1000) {
  std::vector<std::string> out;
  const auto end = std::chrono::steady_clock::now() + how_long;
  while (std::chrono::steady_clock::now() < end && static_cast<int>(out.size()) < until) {
    const auto packet = source.next({});
    if (!packet.ok()) break;
    const auto bytes = packet->bytes.bytes();
    if (packet->kind == PacketKind::Fault)
      out.push_back("fault: " + decode_fault(1, {}, bytes)->detail);
    else if (bytes.size() != 48)
      out.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  return out;
}

constexpr auto kLong = std::chrono::milliseconds(20'000);  // for a slow computer; the tests end as soon as they can

std::string page(const std::string& body) {
  return fmt::format("HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{}", body.size(),
                     body);
}
const std::string kTime = R"({"sensor": {"timestamp": {"mode": "TIME_FROM_PTP_1588"}}})";

TEST(OusterAsking, ByHttpTheMetadataComeOnceAndTheTimeEachSecond) {
  const std::string metadata = test::ouster_metadata();
  const Server server([&](std::string& so_far) -> std::optional<std::string> {
    if (so_far.find("\r\n\r\n") == std::string::npos) return "";
    if (so_far.starts_with("GET /api/v1/sensor/metadata HTTP/1.")) return page(metadata);
    if (so_far.starts_with("GET /api/v1/time HTTP/1.")) return page(kTime);
    return {};
  });
  OusterAskingSource source(std::make_unique<Datagrams>(), {"127.0.0.1", server.port(), 1});
  ASSERT_TRUE(source.open().ok());
  const auto texts = read(source, kLong, 3);
  ASSERT_EQ(texts.size(), 3u);
  EXPECT_EQ(texts[0], metadata) << "as it came";
  EXPECT_EQ(texts[1], kTime);
  EXPECT_EQ(texts[2], kTime);
  ASSERT_TRUE(source.open().ok());
  const auto again = read(source, kLong, 1);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0], metadata) << "after the source was opened again";
}

TEST(OusterAsking, OldFirmwareIsAskedByTextCommands) {
  const Server web([](std::string& so_far) -> std::optional<std::string> {
    if (so_far.find("\r\n\r\n") == std::string::npos) return "";
    return "HTTP/1.1 404 Not Found\r\n\r\n";
  });
  const Server text([](std::string& so_far) -> std::optional<std::string> {
    const auto line = so_far.find('\n');
    if (line == std::string::npos) return "";
    const std::string command = so_far.substr(0, line);
    so_far.erase(0, line + 1);
    if (command == "get_sensor_info") return "{\"prod_line\": \"OS-1-64\", \"prod_sn\": \"991900000001\"}\n";
    if (command == "get_beam_intrinsics")
      return "{\"beam_altitude_angles\": [3, 1, -1, -3], \"beam_azimuth_angles\": [1, 1, 1, 1]}\n";
    if (command == "get_config_param active")
      return "{\"lidar_mode\": \"1024x10\", \"timestamp_mode\": \"TIME_FROM_SYNC_PULSE_IN\"}\n";
    if (command == "get_time_info")
      return "{\"timestamp\": {\"mode\": \"TIME_FROM_SYNC_PULSE_IN\"}, \"sync_pulse_in\": {\"locked\": 1}}\n";
    return "error: unknown command\n";
  });
  OusterAskingSource source(std::make_unique<Datagrams>(), {"127.0.0.1", web.port(), text.port()});
  ASSERT_TRUE(source.open().ok());
  const auto texts = read(source, kLong, 4);
  ASSERT_EQ(texts.size(), 4u);
  EXPECT_NE(texts[0].find("HTTP status 404"), std::string::npos) << texts[0];
  // The time was asked by text already, before the metadata were asked again.
  const auto metadata = parse_ouster_metadata(texts[1].find("beam") == std::string::npos ? texts[2] : texts[1]);
  ASSERT_TRUE(metadata.ok()) << metadata.error().message;
  EXPECT_EQ(metadata->product, "OS-1-64");
  EXPECT_EQ(metadata->columns_per_frame, 1024);
  EXPECT_EQ(metadata->timestamp_mode, OusterTimestampMode::SyncPulse);
  const auto clock = parse_ouster_clock(texts[3]);
  ASSERT_TRUE(clock.ok()) << clock.error().message;
  EXPECT_TRUE(clock->is_pulse_locked);
}

TEST(OusterAsking, ASilentScannerIsToldAndTheDatagramsGoOn) {
  const Server silent([](std::string&) { return ""; });
  OusterAskingSource source(std::make_unique<Datagrams>(), {"127.0.0.1", silent.port(), 1});
  ASSERT_TRUE(source.open().ok());
  const auto began = std::chrono::steady_clock::now();
  ASSERT_TRUE(source.next({}).ok());
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(1)) << "it did not wait";
  const auto texts = read(source, kLong, 1);
  ASSERT_EQ(texts.size(), 1u);
  EXPECT_NE(texts[0].find("no answer"), std::string::npos) << texts[0];
}

TEST(HttpBody, IsReadWholeOrRefused) {
  EXPECT_EQ(http_body("HTTP/1.0 200 OK\r\n\r\n{}").value(), "{}");
  EXPECT_EQ(
      http_body("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{\"\r\n3\r\na\"}\r\n0\r\n\r\n").value(),
      "{\"a\"}");
  EXPECT_EQ(http_body("HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\n{}").error().code, ErrorCode::Malformed);
  EXPECT_EQ(http_body("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n9\r\n{\"").error().code,
            ErrorCode::Malformed);
  EXPECT_EQ(http_body("HTTP/1.1 503 Busy\r\n\r\n").error().code, ErrorCode::Unavailable);
  EXPECT_EQ(http_body("hello").error().code, ErrorCode::Malformed);
}

}  // namespace
}  // namespace hueline::drivers
