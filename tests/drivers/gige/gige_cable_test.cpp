#include <fstream>

#include "tests/drivers/gige/gige_reader.hpp"
#include "tests/support/replugs.hpp"

// AravisSource and a camera on two computers: network namespaces with a virtual cable between them.
namespace hueline::drivers {
namespace {

using test::FakeCamera;

// Returns the mean size of the packets that this thread's network received.
double bytes_per_packet(const std::string& interface) {
  std::ifstream file("/proc/thread-self/net/dev");
  std::string word;
  while (file >> word && word != interface + ":") continue;
  double bytes = 0, packets = 0;
  file >> bytes >> packets;
  return bytes / packets;
}

// Two computers and a cable with jumbo frames between them.
class GigeCable : public Gige {
 protected:
  void SetUp() override {
    if (!has_own_network) GTEST_SKIP() << "needs the privilege to make network namespaces";
    machine_id_ = other_.id();
    const std::string there = std::to_string(machine_id_);
    const bool is_laid = machine_id_ &&
                         test::run("ip link add v0 mtu 9000 type veth peer name v1 mtu 9000 netns " + there) &&
                         test::run("ip addr add 10.9.0.1/24 dev v0") && test::run("ip link set v0 up");
    if (!is_laid) GTEST_SKIP() << "this kernel or container makes no veth pair";
    other_.run_there([&] {
      ASSERT_TRUE(test::run("ip addr add 10.9.0.2/24 dev v1") && test::run("ip link set v1 up"));
      camera_.emplace("10.9.0.2", "GV01");
      ASSERT_TRUE(camera_->is_running());
    });
    config_ = at_loopback();
    config_.address = "10.9.0.2";
    config_.interface = "10.9.0.1";
  }
  void TearDown() override {
    other_.run_there([&] { camera_.reset(); });
    test::run("ip link del v0");
  }
  bool run_there(const std::string& command) {
    bool is_done = false;
    other_.run_there([&] { is_done = test::run(command); });
    return is_done;
  }
  test::OtherMachine other_;
  pid_t machine_id_ = 0;
  std::optional<FakeCamera> camera_;
  AravisSource::Config config_;
};

TEST_F(GigeCable, LargeImagesComeInJumboFrames) {
  config_.width = 2048;
  config_.height = 2048;
  config_.frame_rate_hz = 10;
  config_.packet_size = 9000;
  for (const bool packet_socket : {true, false}) {
    config_.packet_socket = packet_socket;
    AravisSource source(config_);
    const auto opened = source.open();
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    const Catch caught = read(source, seconds(8), images(10));
    ASSERT_EQ(caught.images.size(), 10U) << packet_socket;
    for (const Image& image : caught.images) EXPECT_TRUE(!image.is_complete || is_as_painted(image));
    EXPECT_GE(source.counts().complete_images, 8U);
  }
  EXPECT_GT(bytes_per_packet("v0"), 7000) << "not in jumbo frames";
}

TEST_F(GigeCable, PacketsLostOnTheWayAreCounted) {
  if (!run_there("tc qdisc add dev v1 root netem delay 2ms loss 1%"))
    GTEST_SKIP() << "this kernel has no netem (vm.gige has)";
  config_.packet_size = 1500;  // 55 packets an image
  config_.images_in_flight = 300;
  AravisSource source(config_);
  const auto opened = source.open();
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const Catch lossy = read(source, seconds(8),
                           [](const Catch& c) { return c.images.size() > 40 && c.faults.contains(FaultKind::Lost); });
  const auto complete = std::ranges::count_if(lossy.images, [](const Image& i) { return i.is_complete; });
  EXPECT_GT(complete, 0);
  EXPECT_LT(complete, std::ssize(lossy.images));
  for (const Image& image : lossy.images) EXPECT_TRUE(!image.is_complete || is_as_painted(image)) << image.frame_id;
  EXPECT_TRUE(lossy.faults.contains(FaultKind::Lost));
  EXPECT_GT(source.counts().incomplete_images, 0U);
  EXPECT_GT(source.counts().missing_packets, 0U);
}

TEST_F(GigeCable, PulledCableIsDisconnectedAndAPluggedOneOpens) {
  config_.serial = "GV01";
  GuestSource source(guest_of(config_));
  const auto opened = open(source);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  EXPECT_EQ(read(source, seconds(5), images(3)).images.size(), 3U);
  std::vector<double> took_s;
  for (int cycle = 0, cycles = test::replugs(1); cycle < cycles; ++cycle) {
    const bool is_cable = cycle % 2 == 0;  // else the computer's own interface loses its address
    ASSERT_TRUE(is_cable ? run_there("ip link set v1 down") : test::run("ip addr del 10.9.0.1/24 dev v0"));
    EXPECT_EQ(read(
                  source, seconds(20), [](const Catch&) { return false; }, false)
                  .ended,
              ErrorCode::Disconnected)
        << cycle;
    if (!is_cable) {
      EXPECT_EQ(open(source).error().code, ErrorCode::Unavailable);
    }
    ASSERT_TRUE(is_cable ? run_there("ip link set v1 up") : test::run("ip addr add 10.9.0.1/24 dev v0"));
    const HostTime back = host_now();
    auto reopened = open(source);
    // As a drive's reader does.
    while (!reopened.ok() && host_now() - back < seconds(10)) reopened = open(source);
    ASSERT_TRUE(reopened.ok()) << cycle << ": " << reopened.error().message;
    const Catch again = read(source, seconds(5), images(3));
    ASSERT_EQ(again.images.size(), 3U) << cycle;
    took_s.push_back(to_seconds(again.images[0].received - back));
  }
  test::print_returns("GigE Vision", took_s);
}

}  // namespace
}  // namespace hueline::drivers
