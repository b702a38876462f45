#include <fcntl.h>
#include <linux/gpio.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/pps/gpio_pps.hpp"
#include "drivers/pps/serial_pps.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {
namespace {

using testing::HasSubstr;

/// A line whose edges the test writes, as the kernel would.
class Line {
 public:
  GpioPps::Request request() {
    return [this](const GpioLine& line, PpsEdgeKind edge) -> Result<FileDescriptor> {
      EXPECT_EQ(line.line, 18u);
      EXPECT_EQ(edge, PpsEdgeKind::Assert);
      int ends[2];
      EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends), 0);
      kernel_ = FileDescriptor(ends[0]);
      return FileDescriptor(ends[1]);
    };
  }
  void edge(std::uint32_t number, std::uint64_t stamp_ns) const {
    gpio_v2_line_event event{};
    event.timestamp_ns = stamp_ns;
    event.id = GPIO_V2_LINE_EVENT_RISING_EDGE;
    event.line_seqno = number;
    EXPECT_EQ(::write(kernel_.get(), &event, sizeof event), static_cast<ssize_t>(sizeof event));
  }
  void half_an_edge() const { EXPECT_EQ(::write(kernel_.get(), "half", 4), 4); }
  void unplug() { kernel_ = {}; }

 private:
  FileDescriptor kernel_;
};

TEST(GpioPps, EdgesHaveTheKernelsStampAndCount) {
  Line line;
  GpioPps source({"/dev/gpiochip0", 18}, PpsEdgeKind::Assert, line.request());
  EXPECT_EQ(source.next({}).error().code, ErrorCode::Disconnected);
  ASSERT_TRUE(source.open().ok());
  EXPECT_EQ(source.next({}).error().code, ErrorCode::TimedOut);
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  const auto stamp = static_cast<std::uint64_t>(to_nanoseconds(now).count());
  line.edge(1, stamp);
  line.edge(4, stamp + 3'000'000);  // two edges are lost
  for (const std::uint64_t number : {1u, 4u}) {
    const auto packet = source.next({});
    ASSERT_TRUE(packet.ok());
    const auto edge = decode_pps(packet->bytes.bytes());
    ASSERT_TRUE(edge.ok());
    EXPECT_EQ(edge->sequence, number);
    EXPECT_EQ(edge->edge, PpsEdgeKind::Assert);
    EXPECT_EQ(edge->time, packet->received);
    EXPECT_LT(std::abs((packet->received - host_now()).count()), 1'000'000'000);
  }
  line.unplug();
  EXPECT_EQ(source.next({}).error().code, ErrorCode::Disconnected);
  ASSERT_TRUE(source.open().ok());
  line.half_an_edge();
  EXPECT_EQ(source.next({}).error().code, ErrorCode::Disconnected);
}

TEST(GpioPps, AChipThatIsNoneIsNamed) {
  GpioPps missing({"/dev/no_gpiochip", 1}, PpsEdgeKind::Assert);
  const Status absent = missing.open();
  EXPECT_EQ(absent.error().code, ErrorCode::Unavailable);
  EXPECT_THAT(absent.error().message, HasSubstr("/dev/no_gpiochip"));
  GpioPps wrong({"/dev/null", 1}, PpsEdgeKind::Clear);
  EXPECT_EQ(wrong.open().error().code, ErrorCode::Unavailable);
}

TEST(SerialPps, FindsTheDeviceThatTheKernelMadeForThePort) {
  const auto sysfs = std::filesystem::temp_directory_path() / ("hueline_pps_" + std::to_string(::getpid()));
  for (const auto& [device, port] : {std::pair{"pps0", ""}, {"pps1", "/dev/ttyS1"}, {"pps2", "/dev/ttyUSB0"}}) {
    std::filesystem::create_directories(sysfs / device);
    std::ofstream(sysfs / device / "path") << port << "\n";
  }
  EXPECT_EQ(*find_pps_of("/dev/ttyUSB0", sysfs.string()), "/dev/pps2");
  EXPECT_EQ(find_pps_of("/dev/ttyS0", sysfs.string()).error().code, ErrorCode::Unavailable);
  EXPECT_EQ(find_pps_of("/dev/ttyS0", (sysfs / "none").string()).error().code, ErrorCode::Unavailable);
  std::filesystem::remove_all(sysfs);
}

TEST(SerialPps, APortThatCannotServeIsNamedWithWhatToDo) {
  SerialPps missing("/dev/no_tty", PpsEdgeKind::Assert);
  EXPECT_THAT(missing.open().error().message, HasSubstr("/dev/no_tty"));
  EXPECT_EQ(missing.next({}).error().code, ErrorCode::Disconnected);
  SerialPps wrong("/dev/null", PpsEdgeKind::Assert);
  EXPECT_THAT(wrong.open().error().message, HasSubstr("line discipline"));
}

}  // namespace
}  // namespace hueline::drivers
