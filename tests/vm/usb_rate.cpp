#include <arv.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/gige/aravis_camera.hpp"
#include "drivers/gige/image_decoder.hpp"
#include "drivers/transport/host_clock.hpp"
#include "drivers/usb3_vision/u3v_source.hpp"
#include "tests/drivers/packet_pool.hpp"
#include "tests/vm/usb_camera.hpp"

// vm_usb_rate MB_A_SECOND SECONDS: what a USB3 Vision camera's images cost in the driver and in Aravis's own stream, by
// turns, in the guest of tests/vm. It is run by hand (docs/performance.md). The camera is another process.
namespace {

using namespace hueline;
using namespace hueline::drivers;
using std::chrono::milliseconds;

constexpr std::uint32_t kWidth = 2448, kHeight = 2048;
constexpr double kImageMB = kWidth * kHeight * 1e-6;

struct Turn {
  double seconds = 0, cpu_s = 0;
  std::uint64_t images = 0, whole = 0, incomplete = 0, lost = 0;
};

double cpu_s() {
  rusage use{};
  ::getrusage(RUSAGE_SELF, &use);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return s(use.ru_utime) + s(use.ru_stime);
}

GenicamConfig settings(double rate_hz) {
  GenicamConfig config;
  config.serial = "HL02";
  config.width = kWidth;
  config.height = kHeight;
  config.frame_rate_hz = rate_hz;
  config.exposure = std::chrono::microseconds(500);
  return config;
}

Turn ours(double rate_hz, nanoseconds time) {
  Turn turn;
  U3vSource source(settings(rate_hz), "HL02", std::make_shared<test::Memory>(400u << 20));
  if (const Status opened = source.open(); !opened) {
    fmt::print("{}\n", opened.error().message);
    return turn;
  }
  ImageDecoder decoder({});
  const double before = cpu_s();
  const HostTime begin = host_now();
  while (host_now() - begin < time) {
    const auto packet = source.next({});
    if (!packet) continue;
    std::vector<Measurement> out;
    if (packet->kind == PacketKind::Fault)
      out.push_back(*decode_fault(packet->sensor, packet->received, packet->bytes.bytes()));
    else
      decoder.decode(*packet, out);
    for (const auto& m : out) {
      if (const auto* fault = std::get_if<Fault>(&m)) turn.lost += fault->count;
      const auto* image = std::get_if<Image>(&m);
      if (!image) continue;
      // Every twentieth image is looked at, because looking costs more than receiving.
      if (turn.images++ % 20 == 0 && image->is_complete) turn.whole += test::UsbCamera::is_as_painted(*image);
      turn.incomplete += !image->is_complete;
    }
  }
  turn.seconds = to_seconds(host_now() - begin);
  turn.cpu_s = cpu_s() - before;
  return turn;
}

Turn of_aravis(double rate_hz, nanoseconds time, ArvUvUsbMode mode) {
  Turn turn;
  GError* error = nullptr;
  arv_update_device_list();
  const GRef<ArvCamera> camera(arv_camera_new(arv_get_n_devices() > 0 ? arv_get_device_id(0) : "none", &error));
  if (!camera || error) {
    fmt::print("Aravis: {}\n", error ? error->message : "no camera");
    return turn;
  }
  arv_camera_uv_set_usb_mode(camera.get(), mode);
  if (const Status set = configure_camera(camera.get(), settings(rate_hz)); !set)
    fmt::print("{}\n", set.error().message);
  {
    const GRef<ArvStream> stream(arv_camera_create_stream(camera.get(), nullptr, nullptr, &error));
    for (int i = 0; i < 16; ++i) arv_stream_push_buffer(stream.get(), arv_buffer_new(kWidth * kHeight, nullptr));
    arv_camera_start_acquisition(camera.get(), &error);
    const double before = cpu_s();
    const HostTime begin = host_now();
    std::uint64_t last = 0;
    while (host_now() - begin < time) {
      ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream.get(), 100'000);
      if (!buffer) continue;
      if (arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS) {
        const std::uint64_t number = arv_buffer_get_frame_id(buffer);
        if (turn.images++ > 0) turn.lost += number - last - 1;
        last = number;
      } else {
        ++turn.incomplete;
      }
      arv_stream_push_buffer(stream.get(), buffer);
    }
    turn.seconds = to_seconds(host_now() - begin);
    turn.cpu_s = cpu_s() - before;
    arv_camera_stop_acquisition(camera.get(), nullptr);
  }
  return turn;
}

void print(const char* what, const Turn& turn) {
  const double MB = static_cast<double>(turn.images) * kImageMB;
  fmt::print("{:<16} {:>6.1f} MB/s {:>5} images {:>4} incomplete {:>5} lost {:>8.3f} ms of processor a MB\n", what,
             MB / std::max(turn.seconds, 1e-9), turn.images, turn.incomplete, turn.lost,
             1e3 * turn.cpu_s / std::max(MB, 1e-9));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const double rate_hz = std::atof(argv[1]) / kImageMB;
  const auto time = std::chrono::seconds(std::atoi(argv[2]));
  const pid_t child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    sim::U3vCamera::Config config;
    config.width = kWidth;
    config.height = kHeight;
    test::UsbCamera camera(config);
    if (!camera.plug()) ::_exit(1);
    for (;;) ::pause();
  }
  for (int i = 0; i < 100 && !is_u3v_on_usb("HL02"); ++i) ::usleep(50'000);
  ::usleep(500'000);
  for (int turn = 0; turn < 2; ++turn) {
    print("hueline", ours(rate_hz, time));
    print("Aravis, sync", of_aravis(rate_hz, time, ARV_UV_USB_MODE_SYNC));
    print("Aravis, async", of_aravis(rate_hz, time, ARV_UV_USB_MODE_ASYNC));
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  return 0;
}
