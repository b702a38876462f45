#pragma once

#include <arv.h>

#include <atomic>
#include <cstdint>
#include <memory>

namespace hueline::test {

/// Aravis's GigE Vision camera in this process. Its pixels say where they belong, and which exposure and gain were set.
class FakeCamera {
 public:
  FakeCamera(const char* interface, const char* serial) : camera_(arv_gv_fake_camera_new(interface, serial)) {
    arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera_), &FakeCamera::fill, this);
  }
  ~FakeCamera() { g_object_unref(camera_); }
  FakeCamera(const FakeCamera&) = delete;
  FakeCamera& operator=(const FakeCamera&) = delete;

  bool is_running() const { return arv_gv_fake_camera_is_running(camera_); }
  /// Sets the share of the stream's packets that the camera does not send.
  void lose(double ratio) { g_object_set(camera_, "gvsp-lost-ratio", ratio, nullptr); }
  std::uint32_t exposure_us() const { return exposure_us_; }
  std::uint32_t gain() const { return gain_; }
  /// Returns the address to which the client wants its images. Any computer on the network may read that from a camera.
  std::uint16_t stream_port() const {
    guint32 port = 0;
    arv_fake_camera_read_register(arv_gv_fake_camera_get_fake_camera(camera_), 0xD00, &port);
    return static_cast<std::uint16_t>(port);
  }

  static std::uint8_t pixel(std::uint64_t frame_id, std::size_t at) {
    return static_cast<std::uint8_t>(frame_id * 31 + at * 7 + (at >> 8) + (at >> 16));
  }

 private:
  static void fill(ArvBuffer* buffer, void* self, guint32 exposure_us, guint32 gain, ArvPixelFormat) {
    auto& camera = *static_cast<FakeCamera*>(self);
    camera.exposure_us_ = exposure_us;
    camera.gain_ = gain;
    gint x = 0, y = 0, width = 0, height = 0;
    arv_buffer_get_image_region(buffer, &x, &y, &width, &height);
    const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    auto* pixels = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, nullptr)));
    const std::uint64_t frame_id = arv_buffer_get_frame_id(buffer);
    for (std::size_t i = 0; i < size; ++i) pixels[i] = pixel(frame_id, i);
  }

  std::atomic<std::uint32_t> exposure_us_{0}, gain_{0};
  ArvGvFakeCamera* camera_;  // last: its thread may fill an image at once
};

}  // namespace hueline::test
