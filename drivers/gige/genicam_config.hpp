#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/keys.hpp"
#include "core/measurements.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline::drivers {

/// The edge at the camera's input that starts an exposure.
enum class TriggerActivation : std::uint8_t { RisingEdge, FallingEdge };

/// The settings of a GigE Vision or USB3 Vision camera: which camera it is, how it is set, and how its images are
/// transported. They do not depend on any library.
struct GenicamConfig {
  // Which camera. It is found by the first of address, id and serial that is set. The serial number is always checked.
  std::string address;  ///< IPv4 address of a GigE camera
  /// Address of this computer towards the camera, with `address` only; if empty, the one on the camera's network.
  std::string interface;
  std::string id;      ///< Aravis's name of the camera, as `arv-tool-0.8` lists it: maker-model-serial
  std::string serial;  ///< the camera's serial number

  // Settings of the camera. Zero, empty and absent values leave the camera's own setting unchanged.
  std::uint32_t width = 0, height = 0;       ///< size of the region, pixels
  std::uint32_t offset_x = 0, offset_y = 0;  ///< corner of the region on the sensor, pixels; used with width and height
  PixelFormat pixel_format = PixelFormat::BayerRG8;
  std::optional<nanoseconds> exposure{};  ///< setting it turns automatic exposure off, or is its longest
  bool auto_exposure = false;             ///< whether the camera chooses its exposures, which it then has to report
  std::optional<double> gain{};           ///< in the camera's unit, most often dB; setting it turns automatic gain off
  double frame_rate_hz = 0;               ///< images a second without trigger; not together with trigger_source
  std::string trigger_source;  ///< input that starts each exposure ("Line0"); if empty, the camera runs freely
  TriggerActivation trigger_activation = TriggerActivation::RisingEdge;
  bool chunks = true;    ///< whether it is asked to report exposure and gain of each image, if it can
  std::string features;  ///< further settings, applied last: "LineSelector=Line1 LineSource=ExposureActive"

  // Transport of GigE cameras.
  std::uint32_t packet_size = 0;  ///< bytes with IP and UDP headers; 0 means the largest that gets through
  nanoseconds packet_delay{0};    ///< time between packets; slows the camera down if a switch or the host loses bursts
  bool packet_resend = true;      ///< whether missing packets are requested again
  /// Whether to bypass the kernel's UDP stack, if privileged; not on loopback, where it receives nothing.
  bool packet_socket = true;
  std::uint32_t socket_buffer_bytes = 0;  ///< 0 means as large as the kernel allows (net.core.rmem_max)
  /// An image whose packets stop coming for this time is delivered as it is.
  std::chrono::milliseconds give_up_after{100};

  // Transport of USB cameras.
  std::uint32_t transfer_MB = 4;  ///< memory of the transfers that are under way; 16 MB are the kernel's usual limit

  // The computer.
  int realtime_priority = 0;  ///< SCHED_RR priority of the receiving thread, 1 to 99; 0 (and without privilege): normal
  std::size_t stream_buffers = 8;     ///< images that the transport may fill or hold ready
  std::size_t images_in_flight = 32;  ///< further images that the recorder and the pipeline may hold at a time

  /// Declares the keys of a rig file, except `width`, `height` and `pixel_format`. These three describe the delivered
  /// image, which may differ from what the camera sends, so GenicamDevice declares them.
  void visit(Keys& keys);
  KeyError validate() const;

  /// Returns all settings as text for the guest that runs the camera (drivers/guest/config_text.hpp).
  std::string to_text() const;
  /// Reads what to_text() wrote. Errors: Malformed, with the key that is wrong.
  static Result<GenicamConfig> from_text(std::string_view text);

 private:
  /// Declares every member: the keys of visit(), and what a rig file does not set in this Config.
  void visit_all(Keys& keys);
};

/// Declares a key whose value is one of the pixel formats of cameras.
bool visit_pixel_format(Keys& keys, const Key& key, PixelFormat& format);

}  // namespace hueline::drivers
