#include <poll.h>

#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/vm/ladybug_on_usb.hpp"
#include "tests/vm/usb_camera.hpp"

// vm_usb_camera genicam|ladybug IMAGES AWAY_MS: an emulated camera for usb.sh and all_buses.sh, of USB3 Vision or a
// Ladybug. It streams, is unplugged in the middle of an image after that many, is plugged in again after that time, and
// streams until its standard input ends. At its end it says how many images were taken from it.
namespace {

/// Waits until the camera has sent `images` more, or until the input ends. Returns false then.
template <class Camera>
bool wait_for(const Camera& camera, std::uint64_t images) {
  const std::uint64_t end = camera.sent() + images;
  pollfd input{0, POLLIN, 0};
  while (camera.sent() < end)
    if (::poll(&input, 1, 20) > 0) return false;
  return true;
}

template <class Camera>
bool plug(Camera& camera) {
  const hueline::Status plugged = camera.plug();
  if (!plugged) std::fprintf(stderr, "%s\n", plugged.error().message.c_str());
  return plugged.ok();
}

template <class Camera, class Fault>
int stream(Camera& camera, Fault unplug, std::uint64_t images, std::chrono::milliseconds away) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  if (!plug(camera) || !wait_for(camera, images)) return 1;
  camera.spoil(unplug);
  std::this_thread::sleep_for(away);
  if (!plug(camera)) return 1;
  std::puts("plugged in again");
  if (wait_for(camera, images)) {
    std::printf("%llu images since\n", static_cast<unsigned long long>(images));
    pollfd input{0, POLLIN, 0};
    ::poll(&input, 1, -1);
  }
  std::printf("%llu images taken by the computer\n", static_cast<unsigned long long>(camera.sent()));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const auto images = static_cast<std::uint64_t>(std::atoi(argv[2]));
  const std::chrono::milliseconds away(std::atoi(argv[3]));
  if (std::string_view(argv[1]) == "ladybug") {
    hueline::test::LadybugOnUsb camera;
    return stream(camera, hueline::sim::LadybugFault::Unplug, images, away);
  }
  hueline::sim::U3vCamera::Config config;
  config.width = 320;
  config.height = 240;
  hueline::test::UsbCamera camera(config);
  return stream(camera, hueline::sim::U3vFault::Unplug, images, away);
}
