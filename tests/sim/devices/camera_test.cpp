#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "sim/devices/gvcp_control.hpp"
#include "sim/devices/player.hpp"
#include "tests/sim/short_drive.hpp"

#ifdef HUELINE_SANITIZE_THREAD
// Aravis and GLib are not built with ThreadSanitizer, so it cannot see the queue by which the thread of a stream hands
// over an image. Only the client of this test reads such images.
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libaravis-0.8.so\n"
         "called_from_lib:libgio-2.0.so\n"
         "called_from_lib:libglib-2.0.so\n"
         "called_from_lib:libgobject-2.0.so\n"
         "race:AravisClient\n";
}
#endif

namespace hueline::sim {
namespace {

using namespace std::chrono_literals;

/// A client like that of any program: the camera and stream classes of Aravis, and sockets without privileges.
class AravisClient {
 public:
  struct Seen {
    std::uint64_t frame_id = 0, timestamp = 0;
    ArvBufferStatus status = ARV_BUFFER_STATUS_UNKNOWN;
    Bytes pixels;
  };

  explicit AravisClient(const char* address, bool resends = true) {
    GError* error = nullptr;
    camera_ = arv_camera_new(address, &error);
    EXPECT_EQ(error, nullptr) << error->message;
    g_clear_error(&error);
    if (camera_ == nullptr) return;
    arv_camera_gv_set_stream_options(camera_, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    packet_bytes_ = arv_camera_gv_auto_packet_size(camera_, nullptr);
    stream_ = arv_camera_create_stream(camera_, nullptr, nullptr, &error);
    EXPECT_EQ(error, nullptr) << error->message;
    g_clear_error(&error);
    g_object_set(stream_, "packet-resend",
                 resends ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
                 "packet-request-ratio", 1.0, "packet-timeout", 20000U, "frame-retention", 400000U, "socket-buffer",
                 ARV_GV_STREAM_SOCKET_BUFFER_AUTO, nullptr);
    for (int i = 0; i < 12; ++i) {
      arv_stream_push_buffer(stream_, arv_buffer_new_allocate(arv_camera_get_payload(camera_, nullptr)));
    }
  }
  AravisClient(const AravisClient&) = delete;
  ~AravisClient() {
    g_clear_object(&stream_);
    g_clear_object(&camera_);
  }
  ArvCamera* camera() { return camera_; }
  unsigned packet_bytes() const { return packet_bytes_; }
  void start() { arv_camera_start_acquisition(camera_, nullptr); }
  void stop() { arv_camera_stop_acquisition(camera_, nullptr); }

  std::vector<Seen> take(std::size_t count, std::chrono::milliseconds silence = 1500ms) {
    std::vector<Seen> seen;
    while (seen.size() < count) {
      ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream_, static_cast<guint64>(silence.count()) * 1000);
      if (buffer == nullptr) break;
      Seen s;
      s.frame_id = arv_buffer_get_frame_id(buffer);
      s.timestamp = arv_buffer_get_timestamp(buffer);
      s.status = arv_buffer_get_status(buffer);
      std::size_t size = 0;
      const auto* data = static_cast<const std::byte*>(arv_buffer_get_data(buffer, &size));
      if (s.status == ARV_BUFFER_STATUS_SUCCESS) s.pixels.assign(data, data + size);
      seen.push_back(std::move(s));
      arv_stream_push_buffer(stream_, buffer);
    }
    return seen;
  }

 private:
  ArvCamera* camera_ = nullptr;
  ArvStream* stream_ = nullptr;
  unsigned packet_bytes_ = 0;
};

/// Returns an address of lo that only this process uses, because GVCP has a fixed port and other tests have cameras
/// too.
std::string address() {
  const int pid = ::getpid();
  return "127." + std::to_string(64 + (pid >> 14) % 64) + "." + std::to_string((pid >> 7) % 128) + "." +
         std::to_string(1 + pid % 128);
}

/// Makes images that all differ, and whose pixels differ from their neighbours.
Bytes picture(std::uint32_t width, std::uint32_t height, std::uint32_t number) {
  Bytes pixels(std::size_t{width} * height);
  std::uint32_t x = 2654435761U * (number + 1);
  for (std::byte& p : pixels) {
    x = x * 1664525U + 1013904223U;
    p = static_cast<std::byte>(x >> 24U);
  }
  return pixels;
}

class CameraTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hueline-camera-test-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Drive drive_with_images(int seconds, std::int64_t period_ns, std::uint32_t width, std::uint32_t height) {
    Drive drive;
    drive.cache_dir = folder_.string();
    drive.begin_gps_ns = test::kBegin;
    drive.end_gps_ns = test::kBegin + seconds * 1'000'000'000LL;
    for (std::uint32_t i = 0; i * period_ns < drive.end_gps_ns - drive.begin_gps_ns; ++i) {
      const std::string file = std::to_string(i) + ".raw";
      const Bytes pixels = picture(width, height, i);
      std::ofstream(folder_ / file, std::ios::binary)
          .write(reinterpret_cast<const char*>(pixels.data()), ssize_t(pixels.size()));
      drive.exposures.push_back({i, test::kBegin + i * period_ns, 2'000'000, width, height, file});
    }
    return drive;
  }
  static Player::Config camera_only(std::uint32_t width, std::uint32_t height) {
    Player::Config config;
    config.laser.reset();
    config.pos.reset();
    config.pps.reset();
    config.camera->interface = address();
    config.camera->width = width;
    config.camera->height = height;
    return config;
  }
  /// Plays the drive and expects each image once, complete and in order, with the counter and frame id of its exposure.
  void expect_every_image(const Player::Config& config, const Timeline& timeline) {
    auto player = Player::open(config).value();
    AravisClient client(address().c_str());
    ASSERT_NE(client.camera(), nullptr);
    EXPECT_GT(client.packet_bytes(), 8900U);  // Aravis approaches it by halving steps
    EXPECT_EQ(player->wait_until_ready(0, {}).error().code, ErrorCode::TimedOut);
    client.start();
    ASSERT_TRUE(player->wait_until_ready(2'000'000'000, {}).ok());
    PlayReport report;
    std::thread playing([&] { report = player->run(timeline, {}); });
    const auto seen = client.take(timeline.events.size());
    playing.join();
    client.stop();
    EXPECT_EQ(report.of(WireChannel::Camera).failed, 0U) << report.first_camera_problem;
    RecordProperty("packets_sent", std::to_string(report.camera.packets_sent));
    ASSERT_EQ(seen.size(), timeline.events.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const WireEvent& event = timeline.events[i];
      EXPECT_EQ(seen[i].status, ARV_BUFFER_STATUS_SUCCESS) << i;
      EXPECT_EQ(seen[i].frame_id, event.sequence + 1);
      EXPECT_EQ(static_cast<std::int64_t>(seen[i].timestamp), event.camera_counter_ns);
      EXPECT_TRUE(seen[i].pixels == picture(event.width, event.height, static_cast<std::uint32_t>(event.sequence)))
          << i;
    }
    EXPECT_TRUE(client.take(1, 100ms).empty());
  }
  static Timeline images_of(const Drive& drive) {
    Timeline timeline = build_timeline(drive, {}).value();
    std::erase_if(timeline.events, [](const WireEvent& e) { return e.channel != WireChannel::Camera; });
    return timeline;
  }

  std::filesystem::path folder_;
};

TEST_F(CameraTest, EveryImageArrivesWholeAtTwoHertz) {
  expect_every_image(camera_only(1224, 1536), images_of(drive_with_images(2, 500'000'000, 1224, 1536)));
}

TEST_F(CameraTest, EveryImageArrivesWholeAtFiveHertzAndSixMegapixels) {
  expect_every_image(camera_only(2448, 2448), images_of(drive_with_images(2, 200'000'000, 2448, 2448)));
}

TEST_F(CameraTest, PacketsLostOnTheWayAreSentAgainOnRequest) {
  Player::Config config = camera_only(1224, 1536);
  config.camera->stream.lost_packet_share = 0.02;
  expect_every_image(config, images_of(drive_with_images(1, 300'000'000, 1224, 1536)));
}

TEST_F(CameraTest, WithoutResendTheClientSeesIncompleteImages) {
  Player::Config config = camera_only(640, 480);
  config.camera->stream.lost_packet_share = 0.2;
  auto player = Player::open(config).value();
  AravisClient client(address().c_str(), false);
  client.start();
  const Timeline timeline = images_of(drive_with_images(1, 300'000'000, 640, 480));
  PlayReport report;
  std::thread playing([&] { report = player->run(timeline, {}); });
  const auto seen = client.take(4);
  playing.join();
  EXPECT_GT(report.camera.packets_lost_on_purpose, 0U);
  EXPECT_EQ(report.camera.packets_resent, 0U);
  EXPECT_TRUE(
      std::any_of(seen.begin(), seen.end(), [](const auto& s) { return s.status != ARV_BUFFER_STATUS_SUCCESS; }));
}

TEST_F(CameraTest, ALostExposureIsAGapAndARestartCountsFromOne) {
  Player::Config config = camera_only(320, 240);
  config.speed = 2;
  auto player = Player::open(config).value();
  Timeline timeline = images_of(drive_with_images(1, 200'000'000, 320, 240));
  timeline.events.erase(timeline.events.begin() + 2);
  for (int acquisition = 0; acquisition < 2; ++acquisition) {
    AravisClient client(address().c_str());
    client.start();
    ASSERT_TRUE(player->wait_until_ready(2'000'000'000, {}).ok());
    (void)player->run(timeline, {});
    std::vector<std::uint64_t> ids;
    for (const auto& s : client.take(4)) ids.push_back(s.frame_id);
    EXPECT_THAT(ids, testing::ElementsAre(1, 2, 4, 5));
    client.stop();
  }
}

TEST_F(CameraTest, DeliversTheClientsRegionAndSaysWhatFailed) {
  auto player = Player::open(camera_only(320, 240)).value();
  AravisClient client(address().c_str());
  arv_camera_set_region(client.camera(), 16, 32, 100, 50, nullptr);
  client.start();
  Timeline timeline = images_of(drive_with_images(1, 400'000'000, 320, 240));
  std::filesystem::remove(folder_ / timeline.events[1].image_file);
  const PlayReport report = player->run(timeline, {});
  const auto seen = client.take(2);
  ASSERT_EQ(seen.size(), 2U);
  const Bytes whole = picture(320, 240, 0);
  ASSERT_GE(seen[0].pixels.size(), 5000U);
  for (std::size_t row = 0; row < 50; ++row) {
    ASSERT_TRUE(std::equal(whole.begin() + ssize_t((32 + row) * 320 + 16),
                           whole.begin() + ssize_t((32 + row) * 320 + 116),
                           seen[0].pixels.begin() + ssize_t(row * 100)));
  }
  EXPECT_EQ(seen[1].frame_id, 3U);
  EXPECT_EQ(report.of(WireChannel::Camera).failed, 1U);
  EXPECT_THAT(report.first_camera_problem, testing::HasSubstr("1.raw"));
}

sockaddr_in host(std::uint16_t port) {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  a.sin_port = htons(port);
  return a;
}

Bytes bytes(std::initializer_list<int> values) {
  Bytes out;
  for (const int v : values) out.push_back(static_cast<std::byte>(v));
  return out;
}

TEST(GvcpControl, OneControllerWithAHeartbeat) {
  CameraRegisters::Config config;
  config.width = 64;
  config.height = 48;
  GvcpControl control(CameraRegisters::create(config).value());
  const Bytes take = bytes({0x42, 1, 0, 0x82, 0, 8, 0, 7, 0, 0, 0x0A, 0, 0, 0, 0, 2});
  const Bytes start = bytes({0x42, 1, 0, 0x82, 0, 8, 0, 8, 0, 1, 0, 0x1C, 0, 0, 0, 1});
  EXPECT_EQ(control.handle(start, host(1), 0).answer, bytes({0x80, 0x06, 0, 0x83, 0, 4, 0, 8, 0, 0, 0, 0}));
  EXPECT_EQ(control.handle(take, host(1), 0).answer, bytes({0, 0, 0, 0x83, 0, 4, 0, 7, 0, 0, 0, 1}));
  EXPECT_EQ(control.handle(take, host(2), 0).answer, bytes({0x80, 0x06, 0, 0x83, 0, 4, 0, 7, 0, 0, 0, 0}));
  (void)control.handle(start, host(1), 1'000'000'000);
  EXPECT_EQ(control.registers().get(camera_register::kAcquisition), 1U);
  EXPECT_FALSE(control.check_heartbeat(3'900'000'000));
  EXPECT_TRUE(control.check_heartbeat(4'100'000'000));
  EXPECT_EQ(control.registers().get(camera_register::kAcquisition), 0U);
  EXPECT_EQ(control.handle(take, host(2), 5'000'000'000).answer[1], std::byte{0});
}

TEST(GvcpControl, SurvivesBrokenDatagrams) {
  CameraRegisters::Config config;
  config.width = 64;
  config.height = 48;
  GvcpControl control(CameraRegisters::create(config).value());
  (void)control.handle(bytes({0x42, 1, 0, 0x82, 0, 8, 0, 7, 0, 0, 0x0A, 0, 0, 0, 0, 2}), host(1), 0);
  SeededRandom random(1, 1);
  for (int i = 0; i < 20'000; ++i) {
    Bytes datagram(static_cast<std::size_t>(random.between(0, 40)));
    for (std::byte& b : datagram) b = static_cast<std::byte>(random.next());
    if (datagram.size() > 8 && i % 4 != 0) {  // most datagrams look like a command
      datagram[0] = std::byte{0x42};
      datagram[2] = std::byte{0};
      datagram[3] = static_cast<std::byte>(2 * random.between(0, 70));
      datagram[4] = std::byte{0};
      datagram[5] = static_cast<std::byte>(datagram.size() - 8);
      if (i % 2 == 0 && datagram.size() > 12) datagram[8] = datagram[9] = std::byte{0};
    }
    (void)control.handle(datagram, host(1), 0);
  }
}

}  // namespace
}  // namespace hueline::sim
