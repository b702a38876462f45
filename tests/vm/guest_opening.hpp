#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <thread>
#include <utility>

#include "drivers/guest/guest_source.hpp"
#include "drivers/transport/host_clock.hpp"

/// Cameras of guests in tests on the kernel's virtual USB host.
namespace hueline::test {

/// Returns the settings of a guest on a machine that is so busy that it seems to hang.
inline drivers::GuestSource::Config patient_guest(std::string driver, std::string text, std::size_t slots) {
  drivers::GuestSource::Config guest;
  guest.driver = std::move(driver);
  guest.text = std::move(text);
  guest.slots = slots;
  guest.hung_after = std::chrono::milliseconds(20'000);
  guest.started_within = std::chrono::milliseconds(20'000);
  return guest;
}

/// Opens a source, waiting for its guest.
inline Status open(drivers::GuestSource& source) {
  for (;;)
    if (Status opened = source.open(); opened.ok() || opened.error().code != ErrorCode::TimedOut) return opened;
}

/// Opens, and tries again as a reader does while the camera is absent.
inline Status open_within(drivers::GuestSource& source, nanoseconds limit) {
  for (const HostTime begin = drivers::host_now();;)
    if (Status opened = open(source); opened.ok() || drivers::host_now() - begin > limit)
      return opened;
    else
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
}

}  // namespace hueline::test
