#include <gmock/gmock.h>
#include <linux/filter.h>

#include <fstream>

#include "drivers/gige/gvsp_filter.hpp"
#include "tests/drivers/gige/gige_reader.hpp"
#include "tests/drivers/gige/hostile_datagrams.hpp"

// A camera's client under attack: datagrams to its stream port, from strangers and from the camera's own address.
namespace hueline::drivers {
namespace {

using test::FakeCamera;
using test::HostileSender;

std::uint64_t peak_memory_kb(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  std::string word;
  while (status >> word && word != "VmPeak:") continue;
  std::uint64_t kb = 0;
  status >> kb;
  return kb;
}

class GigeHostile : public Gige {
 protected:
  void SetUp() override {
    Gige::SetUp();
    camera_.emplace("127.0.0.1", "GV01");
    ASSERT_TRUE(camera_->is_running());
    source_.emplace(guest_of(at_loopback()));
    const Status opened = open(*source_);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    ASSERT_EQ(read(*source_, seconds(30), images(3)).images.size(), 3U);
    guest_ = source_->guest_pid();
  }
  /// Reads images until `count` whole ones have come. Datagrams from the camera's own address disturb the images whose
  /// packets they forge, and Aravis treats a hundred frame ids before the latest as late. Everything else must be as
  /// painted.
  void expect_images(std::size_t count) {
    const auto whole = [](const Catch& c) {
      return static_cast<std::size_t>(
          std::ranges::count_if(c.images, [](const Image& i) { return i.is_complete && is_as_painted(i); }));
    };
    // Forged packets may leave their bytes in an image, so it is kept only until the next one, and its slot is used
    // again.
    std::size_t seen = 0;
    Catch caught;
    for (int i = 0; i < 200 && seen < count && !caught.ended; ++i)
      seen += whole(caught = read(*source_, seconds(10), images(1)));
    EXPECT_FALSE(caught.ended.has_value()) << "the guest ended";
    EXPECT_GE(seen, count);
    EXPECT_EQ(source_->guest_pid(), guest_) << "it was another guest";
  }
  std::optional<FakeCamera> camera_;
  std::optional<GuestSource> source_;
  pid_t guest_ = 0;
};

TEST_F(GigeHostile, DatagramsFromStrangersChangeNothing) {
  HostileSender stranger("127.0.0.2", "127.0.0.1", camera_->stream_port());
  ASSERT_TRUE(stranger.is_ready());
  std::mt19937 random(1);
  for (std::uint16_t round = 0; round < 5; ++round) {
    stranger.kill(static_cast<std::uint16_t>(1000 + round));
    stranger.fill_memory(2000);
    stranger.claim_parts(3000);
    stranger.anything(random, 200);
    const Catch caught = read(*source_, seconds(30), images(5));
    for (const Image& image : caught.images) EXPECT_TRUE(!image.is_complete || is_as_painted(image)) << image.frame_id;
  }
  EXPECT_GT(stranger.sent(), 1000U);
  expect_images(10);
}

TEST_F(GigeHostile, DatagramsFromTheCamerasAddressNeitherKillNorFillMemory) {
  HostileSender forger("127.0.0.1", "127.0.0.1", camera_->stream_port());
  ASSERT_TRUE(forger.is_ready());
  const std::uint64_t before_kb = peak_memory_kb(guest_);
  std::mt19937 random(2);
  for (std::uint16_t round = 0; round < 5; ++round) {
    forger.kill(static_cast<std::uint16_t>(1000 + round));
    forger.fill_memory(2000);
    forger.claim_parts(3000);
    forger.anything(random, 500);
    read(
        *source_, milliseconds(200), [](const Catch&) { return false; }, false);
    ASSERT_EQ(source_->guest_pid(), guest_) << "the guest died in round " << round;
  }
  EXPECT_GT(forger.sent(), 2500U);
  expect_images(10);
  EXPECT_LT(peak_memory_kb(guest_) - before_kb, 100'000U);
}

/// Returns what the filter does with a datagram: the kernel runs it on a pair of sockets.
class GvspFilter : public testing::Test {
 protected:
  void SetUp() override {
    receiver_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in any{};
    any.sin_family = AF_INET;
    ::inet_pton(AF_INET, "127.0.0.1", &any.sin_addr);
    ASSERT_EQ(::bind(receiver_, reinterpret_cast<const sockaddr*>(&any), sizeof(any)), 0);
    GvspStreamShape shape;
    shape.camera = shape.own = any.sin_addr;
    shape.own_port = ntohs(bound_address(receiver_).sin_port);
    shape.payload_bytes = 76'800;
    shape.packet_bytes = 1500;  // 1464 bytes of data: 53 packets; with extended ids 1452: 53
    ASSERT_TRUE(attach_filter(receiver_, gvsp_filter_of_udp_socket(shape)).ok());
    sender_.emplace("127.0.0.1", "127.0.0.1", shape.own_port);
    stranger_.emplace("127.0.0.2", "127.0.0.1", shape.own_port);
  }
  void TearDown() override { ::close(receiver_); }
  bool passes(HostileSender& sender, const HostileSender::Bytes& bytes) {
    sender.send(bytes);
    char space[4096];
    const ssize_t size = ::recv(receiver_, space, sizeof(space), MSG_DONTWAIT);
    EXPECT_TRUE(size < 0 || size == std::ssize(bytes)) << "cut";
    return size >= 0;
  }
  static HostileSender::Bytes leader(std::uint32_t number, std::uint8_t payload_type, std::size_t size = 36) {
    auto bytes = HostileSender::packet(7, 1, number, size);
    bytes[11] = payload_type;
    return bytes;
  }
  int receiver_ = -1;
  std::optional<HostileSender> sender_, stranger_;
};

TEST_F(GvspFilter, PassesWhatAnImageCanHave) {
  EXPECT_TRUE(passes(*sender_, leader(0, 1)));
  EXPECT_TRUE(passes(*sender_, leader(0, 5)));
  for (const std::uint32_t number : {1, 2, 52, 53})
    EXPECT_TRUE(passes(*sender_, HostileSender::packet(7, 3, number, 1464))) << number;
  EXPECT_TRUE(passes(*sender_, HostileSender::packet(7, 3, 53, 1)));
  for (const std::uint32_t number : {2, 54})
    EXPECT_TRUE(passes(*sender_, HostileSender::packet(7, 2, number, 8))) << number;
  EXPECT_TRUE(passes(*sender_, HostileSender::extended_packet(1ULL << 40, 3, 53, 1452)));
  EXPECT_TRUE(passes(*sender_, HostileSender::extended_packet(1, 2, 54, 8)));
  auto extended = HostileSender::extended_packet(1, 1, 0, 36);
  extended[23] = 1;
  EXPECT_TRUE(passes(*sender_, extended));
}

TEST_F(GvspFilter, DropsEverythingElse) {
  EXPECT_FALSE(passes(*stranger_, HostileSender::packet(7, 3, 1, 1464))) << "another address";
  EXPECT_FALSE(passes(*sender_, leader(1, 1))) << "a leader that is not the first";
  EXPECT_FALSE(passes(*sender_, leader(0, 1, 35))) << "a leader that is cut";
  for (const int type : {0, 2, 3, 4, 6, 7, 8, 9, 10, 11})
    EXPECT_FALSE(passes(*sender_, leader(0, static_cast<std::uint8_t>(type)))) << type;
  for (const std::uint32_t number : {0U, 54U, 55U, 999'000U, 0xffffffU})
    EXPECT_FALSE(passes(*sender_, HostileSender::packet(7, 3, number, 1464))) << number;
  for (const std::uint32_t number : {0U, 1U, 55U, 1'000'000U, 0xffffffU})
    EXPECT_FALSE(passes(*sender_, HostileSender::packet(7, 2, number, 8))) << number;
  for (const std::uint32_t number : {0U, 54U, 0x1000001U, 0xffffffffU})
    EXPECT_FALSE(passes(*sender_, HostileSender::extended_packet(7, 3, number, 100))) << number;
  for (const std::uint32_t type : {0, 4, 5, 6, 7, 8, 127})
    EXPECT_FALSE(passes(*sender_, HostileSender::packet(7, type, 2, 100))) << type;
  EXPECT_FALSE(passes(*sender_, HostileSender::packet(7, 3, 1, 1465))) << "longer than agreed";
  for (std::size_t size = 0; size < 8; ++size) EXPECT_FALSE(passes(*sender_, HostileSender::Bytes(size, 3))) << size;
  auto cut = HostileSender::extended_packet(7, 3, 1, 0);
  cut.resize(19);
  EXPECT_FALSE(passes(*sender_, cut)) << "an extended header that is cut";
}

}  // namespace
}  // namespace hueline::drivers
