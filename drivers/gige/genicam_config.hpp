#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "core/keys.hpp"
#include "core/measurements.hpp"
#include "core/time.hpp"

namespace hueline::drivers {

/// Which edge at the camera's input starts an exposure.
enum class TriggerActivation : std::uint8_t { RisingEdge, FallingEdge };

/// A GigE Vision or USB3 Vision camera: which one it is, how it is set, how its images come. Knows no library.
struct GenicamConfig {
  // Which camera. The first of address, id and serial that is set finds it; serial is checked in any case.
  std::string address;    ///< IPv4 address of a GigE camera
  std::string interface;  ///< own IPv4 address towards it, with `address` only; empty: the one on the camera's network
  std::string id;         ///< Aravis's name of it, as `arv-tool-0.8` lists it: maker-model-serial
  std::string serial;     ///< the camera's serial number

  // What it is set to. Zero, empty and absent leave the camera's own setting.
  std::uint32_t width = 0, height = 0;       ///< region, pixels
  std::uint32_t offset_x = 0, offset_y = 0;  ///< its corner on the sensor, pixels; used with width and height
  PixelFormat pixel_format = PixelFormat::BayerRG8;
  std::optional<nanoseconds> exposure{};  ///< turns automatic exposure off
  std::optional<double> gain{};           ///< the camera's unit, most often dB; turns automatic gain off
  double frame_rate_hz = 0;               ///< free running; not together with trigger_source
  std::string trigger_source;             ///< input that starts each exposure ("Line0"); empty: free running
  TriggerActivation trigger_activation = TriggerActivation::RisingEdge;
  std::string features;  ///< anything else, set last: "LineSelector=Line1 LineSource=ExposureActive"

  // GigE transport.
  std::uint32_t packet_size = 0;  ///< bytes with IP and UDP headers; 0: the largest that gets through
  nanoseconds packet_delay{0};    ///< between packets: paces the camera where a switch or host loses bursts
  bool packet_resend = true;      ///< ask again for missing packets
  bool packet_socket = true;      ///< bypass the UDP stack if privileged; never on loopback, where it gets nothing
  std::uint32_t socket_buffer_bytes = 0;         ///< 0: as large as the kernel allows (net.core.rmem_max)
  std::chrono::milliseconds give_up_after{100};  ///< an image whose packets stopped coming is handed on as it is

  // Host.
  int realtime_priority = 0;       ///< SCHED_RR of the receiving thread, 1 to 99; 0: normal. Without privilege: normal
  std::size_t stream_buffers = 8;  ///< images that the transport may be filling or hold ready
  std::size_t images_in_flight = 32;  ///< further images that recorder and pipeline may hold at a time

  /// The keys of a rig but `width`, `height` and `pixel_format`: they are those of the images, which need not be those
  /// of what is sent.
  void visit(Keys& keys);
  KeyError validate() const;

  /// Every member with its name, for the guest: what writes and reads this (drivers/guest/config_text.hpp) goes by this
  /// list.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& each) {
    each("address", self.address);
    each("interface", self.interface);
    each("id", self.id);
    each("serial", self.serial);
    each("width", self.width);
    each("height", self.height);
    each("offset_x", self.offset_x);
    each("offset_y", self.offset_y);
    each("pixel_format", self.pixel_format);
    each("exposure", self.exposure);
    each("gain", self.gain);
    each("frame_rate_hz", self.frame_rate_hz);
    each("trigger_source", self.trigger_source);
    each("trigger_activation", self.trigger_activation);
    each("features", self.features);
    each("packet_size", self.packet_size);
    each("packet_delay", self.packet_delay);
    each("packet_resend", self.packet_resend);
    each("packet_socket", self.packet_socket);
    each("socket_buffer_bytes", self.socket_buffer_bytes);
    each("give_up_after", self.give_up_after);
    each("realtime_priority", self.realtime_priority);
    each("stream_buffers", self.stream_buffers);
    each("images_in_flight", self.images_in_flight);
  }
};

}  // namespace hueline::drivers
