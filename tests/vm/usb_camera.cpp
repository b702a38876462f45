#include "tests/vm/usb_camera.hpp"

#include <poll.h>

#include <cstdio>
#include <cstdlib>

// vm_usb_camera IMAGES: an emulated USB3 Vision camera for usb.sh. It streams, is unplugged in the middle of an image
// after that many, is plugged in again 2 s later, and streams until its standard input ends.
namespace {

/// Waits until the camera has sent `images` more, or until the input ends. Returns false then.
bool wait_for(const hueline::test::UsbCamera& camera, std::uint64_t images) {
  const std::uint64_t end = camera.sent() + images;
  pollfd input{0, POLLIN, 0};
  while (camera.sent() < end)
    if (::poll(&input, 1, 20) > 0) return false;
  return true;
}

bool plug(hueline::test::UsbCamera& camera) {
  const hueline::Status plugged = camera.plug();
  if (!plugged) std::fprintf(stderr, "%s\n", plugged.error().message.c_str());
  return plugged.ok();
}

}  // namespace

int main(int argc, char** argv) {
  const auto images = static_cast<std::uint64_t>(argc > 1 ? std::atoi(argv[1]) : 20);
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  hueline::sim::U3vCamera::Config config;
  config.width = 320;
  config.height = 240;
  hueline::test::UsbCamera camera(config);
  if (!plug(camera) || !wait_for(camera, images)) return 1;
  camera.spoil(hueline::sim::U3vFault::Unplug);
  std::this_thread::sleep_for(std::chrono::seconds(2));
  if (!plug(camera)) return 1;
  std::puts("plugged in again");
  if (!wait_for(camera, images)) return 1;
  std::printf("%llu images since\n", static_cast<unsigned long long>(images));
  pollfd input{0, POLLIN, 0};
  ::poll(&input, 1, -1);
  return 0;
}
