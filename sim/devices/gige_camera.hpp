#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>

#include "core/result.hpp"
#include "sim/devices/gvcp_control.hpp"
#include "sim/devices/gvsp_stream.hpp"
#include "sim/devices/socket.hpp"

namespace hueline::sim {

/// A GigE Vision camera behind a network interface. Control, stream and description are written here, so that a library
/// that a client uses is not tested against itself. The stream is paced, because a burst is lost where the receiver's
/// buffer is smaller than the image; images leave at the times of the vehicle, and packets can be requested again.
///
/// The camera delivers the images that it is given, with one frame id each, whatever TriggerMode the client chose,
/// because the vehicle triggers it. A client sees the discovery, registers, heartbeat, packet size test and resend of a
/// real camera.
class GigeCamera {
 public:
  struct Config {
    std::string interface = "127.0.0.1";  ///< name or IPv4 address; its port 3956 (GVCP) must be free
    std::string serial = "HL01";
    std::uint32_t width = 0, height = 0;  ///< size of the sensor, pixels
    std::string pixel_format = "BayerRG8";
    std::uint32_t max_packet_bytes = 9000;  ///< largest packet of the camera, including IP and UDP headers
    bool reports_exposure = false;          ///< whether it offers its exposure and gain as chunks
    GvspStream::Config stream;
    std::string validate() const;
  };
  /// Opens the camera. Errors: Unavailable (no such interface, or its GVCP port is in use).
  static Result<std::unique_ptr<GigeCamera>> open(const Config& config);
  explicit GigeCamera(const Config& config) : config_(config) {}
  ~GigeCamera();

  /// Returns true while a client controls the camera and has started the acquisition. Thread-safe.
  bool is_streaming() const { return stream_->is_active(); }
  /// Sends an image, see GvspStream::send(). Only one thread may call it.
  Status send(const CameraImage& image, const std::stop_token& stop) { return stream_->send(image, stop); }
  /// Thread-safe.
  GvspStream::Counts counts() const { return stream_->counts(); }

 private:
  void run(const std::stop_token& stop);
  void receive(const FileDescriptor& socket);
  void follow_registers();

  const Config config_;
  FileDescriptor control_socket_, global_discovery_socket_, subnet_discovery_socket_, wake_;
  std::unique_ptr<GvcpControl> control_;  // used by the thread only
  std::unique_ptr<GvspStream> stream_;
  std::jthread thread_;
};

}  // namespace hueline::sim
