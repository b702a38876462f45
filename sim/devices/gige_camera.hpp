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

/// A GigE Vision camera behind a network interface: control, stream and description of its own, so that no library that
/// a client uses meets itself. Its stream is paced (a burst is lost where the receiver's buffer is smaller than the
/// image), at the vehicle's moments, and packets can be asked for again.
///
/// It delivers the images it is given, one frame id each, whatever TriggerMode the client chose: the vehicle triggers
/// it. A client sees the discovery, registers, heartbeat, packet size test and resend of a real camera.
class GigeCamera {
 public:
  struct Config {
    std::string interface = "127.0.0.1";  ///< name or IPv4 address; GVCP port 3956 on it must be free
    std::string serial = "HL01";
    std::uint32_t width = 0, height = 0;  ///< of the sensor, pixels
    std::string pixel_format = "BayerRG8";
    std::uint32_t max_packet_bytes = 9000;  ///< the camera's largest, with IP and UDP headers
    GvspStream::Config stream;
    std::string validate() const;
  };
  /// Unavailable: no such interface, or its GVCP port is taken.
  static Result<std::unique_ptr<GigeCamera>> open(const Config& config);
  explicit GigeCamera(const Config& config) : config_(config) {}
  ~GigeCamera();

  /// True while a client controls the camera and has started the acquisition. Thread-safe.
  bool is_streaming() const { return stream_->is_active(); }
  /// GvspStream::send(). Thread-bound.
  Status send(const CameraImage& image, const std::stop_token& stop) { return stream_->send(image, stop); }
  GvspStream::Counts counts() const { return stream_->counts(); }  ///< Thread-safe.

 private:
  void run(const std::stop_token& stop);
  void receive(const FileDescriptor& socket);
  void follow_registers();

  const Config config_;
  FileDescriptor control_socket_, global_discovery_socket_, subnet_discovery_socket_, wake_;
  std::unique_ptr<GvcpControl> control_;  // by the thread
  std::unique_ptr<GvspStream> stream_;
  std::jthread thread_;
};

}  // namespace hueline::sim
