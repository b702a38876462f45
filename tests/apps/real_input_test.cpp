#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "tests/apps/captures.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/recorded_packets.hpp"
#include "tests/support/test_data.hpp"

/// Sends the bytes of real devices on real sockets to the program as a user starts it. The captures say what must be in
/// the recording; the tests read them by their own code.
namespace hueline::apps {
namespace {
using namespace hueline::test;
using Clock = std::chrono::steady_clock;

/// A socket at 127.0.0.1. `port` 0 takes any free port.
class Socket {
 public:
  Socket(int type, std::uint16_t port) : fd_(socket(AF_INET, type | SOCK_CLOEXEC, 0)) {
    sockaddr_in at = address(port);
    if (bind(fd_, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0) ADD_FAILURE() << "bind: " << std::strerror(errno);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { close(fd_); }
  int fd() const { return fd_; }
  std::uint16_t port() const {
    sockaddr_in at{};
    socklen_t size = sizeof at;
    getsockname(fd_, reinterpret_cast<sockaddr*>(&at), &size);
    return ntohs(at.sin_port);
  }
  void send_to(std::uint16_t port, const std::string& payload) const {
    const sockaddr_in at = address(port);
    const auto sent = sendto(fd_, payload.data(), payload.size(), 0, reinterpret_cast<const sockaddr*>(&at), sizeof at);
    EXPECT_EQ(sent, static_cast<ssize_t>(payload.size()));
  }

 private:
  static sockaddr_in address(std::uint16_t port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port = htons(port);
    return at;
  }
  int fd_;
};

/// Returns different UDP ports that are free at this moment.
std::vector<std::uint16_t> free_udp_ports(std::size_t count) {
  std::vector<std::unique_ptr<Socket>> held;
  std::vector<std::uint16_t> ports;
  for (std::size_t i = 0; i < count; ++i)
    ports.push_back(held.emplace_back(std::make_unique<Socket>(SOCK_DGRAM, std::uint16_t{0}))->port());
  return ports;
}

/// Returns whether a socket listens there. Datagrams that are sent before would be lost.
bool is_bound(std::uint16_t port) {
  std::ifstream table("/proc/net/udp");
  char wanted[16];
  std::snprintf(wanted, sizeof wanted, ":%04X 00000000", port);
  std::stringstream text;
  text << table.rdbuf();
  return text.str().find(wanted) != std::string::npos;
}

struct Wire {
  std::uint16_t port;
  std::string payload;
};
struct Due {
  double time_s;
  Wire wire;
};

/// Sends the scanners' datagrams in the rhythm of their captures.
void send_scanners(std::vector<Due> plan) {
  std::stable_sort(plan.begin(), plan.end(), [](const Due& a, const Due& b) { return a.time_s < b.time_s; });
  const Socket out(SOCK_DGRAM, 0);
  const auto begin = Clock::now();
  for (const Due& due : plan) {
    std::this_thread::sleep_until(begin + std::chrono::duration<double>(due.time_s));
    out.send_to(due.wire.port, due.wire.payload);
  }
}

/// Sends the receiver's messages at their own times to the one client.
void send_receiver(int client, const std::vector<Oem7Message>& messages) {
  const auto begin = Clock::now();
  for (const auto& message : messages) {
    std::this_thread::sleep_until(begin + std::chrono::duration<double>(message.time_s));
    ASSERT_EQ(send(client, message.bytes.data(), message.bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(message.bytes.size()));
  }
}

struct Recorded {
  std::map<std::string, std::vector<std::string>> packets;  // by sensor name, wire only
  std::string stream(const std::string& sensor) const {
    std::string out;
    if (packets.contains(sensor))
      for (const auto& packet : packets.at(sensor)) out += packet;
    return out;
  }
  std::vector<std::string> of_size(const std::string& sensor, std::size_t size) const {
    std::vector<std::string> out;
    if (packets.contains(sensor))
      for (const auto& packet : packets.at(sensor))
        if (packet.size() == size) out.push_back(packet);
    return out;
  }
};

Recorded read_recording(const std::filesystem::path& path) {
  Recorded out;
  test::for_each_recorded_packet(path, [&](const Packet& packet, const storage::JournalHeader& header) {
    if (packet.kind != PacketKind::Wire) return;
    const auto bytes = packet.bytes.bytes();
    out.packets[header.sensors.at(packet.sensor).name].emplace_back(reinterpret_cast<const char*>(bytes.data()),
                                                                    bytes.size());
  });
  return out;
}

std::vector<std::string> payloads(const std::vector<Datagram>& datagrams, std::size_t size) {
  std::vector<std::string> out;
  for (const auto& datagram : datagrams)
    if (datagram.payload.size() == size) out.push_back(datagram.payload);
  return out;
}

/// Counts echoes between 0.5 and 130 m in data packets, by the layout in the manual alone: 12 blocks of 100 bytes, 32
/// records of 3 bytes from the 4th byte on, steps of 2 mm. In dual mode (0x39) a firing has two blocks, and an echo
/// that is both the last and the strongest stands in both.
std::uint64_t echoes_in(const std::vector<Datagram>& datagrams) {
  std::uint64_t count = 0;
  for (const auto& datagram : datagrams) {
    if (datagram.payload.size() != 1206) continue;
    const std::size_t blocks_a_firing = little<std::uint8_t>(datagram.payload, 1204) == 0x39 ? 2 : 1;
    for (std::size_t block = 0; block < 12; block += blocks_a_firing)
      for (std::size_t record = 0; record < 32; ++record) {
        std::set<unsigned> steps;
        for (std::size_t twin = 0; twin < blocks_a_firing; ++twin)
          steps.insert(little<std::uint16_t>(datagram.payload, (block + twin) * 100 + 4 + record * 3));
        for (const unsigned step : steps) count += step >= 250 && step <= 65000;
      }
  }
  return count;
}

struct Scanner {
  const char *name, *model, *capture;
  std::size_t data_packets, position_packets;  // as the descriptions of the recordings count them
};
constexpr Scanner kScanners[] = {{"dual", "VLP-16", "velodyne/vlp16_scans.pcap", 603, 0},
                                 {"gps", "VLP-16", "velodyne/vlp16_gps.pcap", 293, 57},
                                 {"hdl", "HDL-32E", "velodyne/hdl32e.pcap", 500, 0}};

/// Everything in the captures is recorded, and the summary counts what they hold.
void expect_whole(const std::filesystem::path& dir, const std::string& receiver_log) {
  const Recorded recorded = read_recording(dir / "drive.mcap");
  const auto summary = read_json(dir / "summary.json");
  for (const Scanner& scanner : kScanners) {
    SCOPED_TRACE(scanner.name);
    const auto sent = datagrams_of(data_dir() / scanner.capture);
    ASSERT_EQ(sent.size(), scanner.data_packets + scanner.position_packets);
    // Two ports have two queues in the kernel, so the order holds only within a port.
    EXPECT_EQ(recorded.of_size(scanner.name, 1206), payloads(sent, 1206));
    EXPECT_EQ(recorded.of_size(scanner.name, 512), payloads(sent, 512));
    EXPECT_EQ(recorded.packets.at(scanner.name).size(), sent.size());
    const auto entry = sensor_entry(summary, scanner.name);
    EXPECT_EQ(entry.at("packets"), sent.size());
    EXPECT_EQ(entry.at("shed"), 0);
    std::uint64_t data = 0;
    for (const auto& [name, count] : entry.at("decoded").at("messages").items())
      if (name.starts_with("data")) data += count.get<std::uint64_t>();
    EXPECT_EQ(data, scanner.data_packets);
    EXPECT_EQ(entry.at("decoded").at("messages").value("position", 0u), scanner.position_packets);
    EXPECT_EQ(entry.at("decoded").at("malformed_bytes"), 0);
  }
  EXPECT_TRUE(recorded.stream("pos") == receiver_log) << "the receiver's bytes are not recorded as sent";
  const auto pos = sensor_entry(summary, "pos");
  EXPECT_EQ(pos.at("bytes"), receiver_log.size());
  for (const auto& [name, count] : counted_by_name(oem7_messages_of(receiver_log)))
    EXPECT_EQ(pos.at("decoded").at("messages").value(name, 0u), count) << name;
  EXPECT_EQ(pos.at("decoded").at("malformed_bytes"), 0);
  EXPECT_EQ(summary.at("journal").at("sequence_gaps"), 0);

  // Each echo is in the cloud, or is counted with a reason.
  std::uint64_t echoes = 0, told = summary.at("points").at("total").get<std::uint64_t>();
  for (const Scanner& scanner : kScanners) echoes += echoes_in(datagrams_of(data_dir() / scanner.capture));
  for (const auto& [reason, count] : summary.at("points").at("not_placed").items()) told += count.get<std::uint64_t>();
  EXPECT_EQ(told, echoes);
}

std::string receiver_log(std::initializer_list<const char*> files) {
  std::string out;
  for (const char* file : files) out += contents(data_dir() / "novatel" / file);
  return out;
}

TEST(RealInput, DevicesOnSocketsAreRecordedWholeAndReplayedToTheSameBytes) {
  HUELINE_REQUIRE_DATA("velodyne/hdl32e.pcap");
  TemporaryFolder dir;
  const Socket server(SOCK_STREAM, 0);
  ASSERT_EQ(listen(server.fd(), 1), 0);
  const auto ports = free_udp_ports(6);
  std::string rig = "rig: real\nsensors:\n  - name: pos\n    driver: novatel\n    tcp: {host: 127.0.0.1, port: " +
                    std::to_string(server.port()) + "}\n" +
                    "    accept_alignment_complete: true\n";  // the vehicle of this recording does not move
  for (std::size_t i = 0; i < 3; ++i)
    rig += std::string("  - name: ") + kScanners[i].name + "\n    driver: velodyne\n    model: " + kScanners[i].model +
           "\n    udp: {ports: [" + std::to_string(ports[2 * i]) + ", " + std::to_string(ports[2 * i + 1]) +
           "], bind_address: 127.0.0.1}\n    T_body_scanner: {position_m: [0, 0, 1], rotation_deg: [0, 0, 0]}\n";
  write_file(dir / "rig.yaml", rig + "colouring: {method: lens}\n");

  Program capture({"capture", dir / "rig.yaml", "--out", dir / "drive", "--until-silent", "--seconds", "60", "--quiet"},
                  dir / "said.txt");
  const auto give_up = Clock::now() + std::chrono::seconds(60);
  for (const std::uint16_t port : ports)
    while (!is_bound(port)) {
      ASSERT_FALSE(capture.has_ended()) << capture.said();
      ASSERT_LT(Clock::now(), give_up) << "port " << port << " was never opened";
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  pollfd waiting{server.fd(), POLLIN, 0};
  ASSERT_EQ(poll(&waiting, 1, 30'000), 1) << capture.said();
  const int client = accept4(server.fd(), nullptr, nullptr, SOCK_CLOEXEC);
  ASSERT_GE(client, 0);

  std::vector<Due> plan;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto datagrams = datagrams_of(data_dir() / kScanners[i].capture);
    for (const auto& datagram : datagrams)
      plan.push_back(
          {datagram.time_s + 3.0, {ports[2 * i + (datagram.payload.size() == 512 ? 1 : 0)], datagram.payload}});
  }
  const std::string log = receiver_log({"ins2.gps"});
  std::thread scanners([&] { send_scanners(std::move(plan)); });
  send_receiver(client, oem7_messages_of(log));
  scanners.join();
  shutdown(client, SHUT_WR);

  const int status = capture.wait();
  close(client);
  EXPECT_EQ(status, 0) << capture.said();
  expect_whole(dir / "drive", log);

  EXPECT_GT(read_json(dir / "drive" / "summary.json").at("points").at("total"), 100'000u);

  const Ran replay = run({"replay", dir / "drive" / "drive.mcap", "--out", dir / "again"});
  EXPECT_EQ(replay.status, status) << replay.said;
  EXPECT_TRUE(contents(dir / "drive" / "cloud.las") == contents(dir / "again" / "cloud.las"));
  EXPECT_TRUE(contents(dir / "drive" / "view.mcap") == contents(dir / "again" / "view.mcap"));
  EXPECT_EQ(contents(dir / "drive" / "summary.json"), contents(dir / "again" / "summary.json"));
}

TEST(RealInput, FilesAsSourcesAreRecordedWhole) {
  HUELINE_REQUIRE_DATA("velodyne/hdl32e.pcap");
  TemporaryFolder dir;
  const std::string log =
      receiver_log({"align.gps", "bestpos.gps", "ins1.gps", "ins2.gps", "rxstatus.gps", "time.gps"});
  write_file(dir / "receiver.gps", log);
  std::string rig =
      "rig: files\nsensors:\n  - name: pos\n    driver: novatel\n    file: " + (dir / "receiver.gps").string() + "\n";
  for (const Scanner& scanner : kScanners)
    rig += std::string("  - name: ") + scanner.name + "\n    driver: velodyne\n    model: " + scanner.model +
           "\n    pcap: {file: " + (data_dir() / scanner.capture).string() +
           "}\n    T_body_scanner: {position_m: [0, 0, 1], rotation_deg: [0, 0, 0]}\n";
  write_file(dir / "rig.yaml", rig + "colouring: {method: lens}\n");
  const Ran capture = run({"capture", dir / "rig.yaml", "--out", dir / "drive", "--until-silent", "--quiet"});
  // Nothing relates the log's time to that of the scanners. The data is recorded, and the program says so.
  EXPECT_EQ(capture.status, 5) << capture.said;
  EXPECT_NE(capture.said.find("no point could be placed"), std::string::npos) << capture.said;
  expect_whole(dir / "drive", log);
  const Ran replay = run({"replay", dir / "drive" / "drive.mcap", "--out", dir / "again"});
  EXPECT_EQ(replay.status, capture.status) << replay.said;
  EXPECT_TRUE(contents(dir / "drive" / "cloud.las") == contents(dir / "again" / "cloud.las"));
  EXPECT_EQ(contents(dir / "drive" / "summary.json"), contents(dir / "again" / "summary.json"));
}

/// The capture file is far larger than the queues. It is read only as fast as it is recorded.
TEST(RealInput, AFileLargerThanTheBuffersIsRecordedWhole) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_scans.pcap");
  constexpr int kTimes = 40;  // 30 MB go through buffers of 16 MB in all
  TemporaryFolder dir;
  const std::string capture = contents(data_file);
  std::string large = capture.substr(0, 24);
  for (int i = 0; i < kTimes; ++i) large += capture.substr(24);
  write_file(dir / "large.pcap", large);
  write_file(
      dir / "rig.yaml",
      "rig: file\nsensors:\n  - name: laser\n    driver: velodyne\n    model: VLP-16\n    pcap: {file: " +
          (dir / "large.pcap").string() +
          "}\n    T_body_scanner: {position_m: [0, 0, 1], rotation_deg: [0, 0, 0]}\ncolouring: {method: lens}\n");
  const Ran ran = run({"capture", dir / "rig.yaml", "--out", dir / "drive", "--buffer", "16", "--quiet"});
  EXPECT_EQ(ran.status, 5) << ran.said;
  const auto entry = sensor_entry(read_json(dir / "drive" / "summary.json"), "laser");
  EXPECT_EQ(entry.at("packets"), 603 * kTimes);
  EXPECT_EQ(entry.at("shed"), 0);
  EXPECT_EQ(read_recording(dir / "drive" / "drive.mcap").packets.at("laser").size(), 603u * kTimes);
}

}  // namespace
}  // namespace hueline::apps
