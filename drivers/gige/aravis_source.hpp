#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/measurements.hpp"
#include "core/packet.hpp"

namespace hueline::drivers {

/// Which edge at the camera's input starts an exposure.
enum class TriggerActivation : std::uint8_t { RisingEdge, FallingEdge };

/// What the stream has seen since the source was made, reopenings included. Packets are the transport's (GVSP); a USB3
/// camera has none and leaves them 0.
struct ImageStreamCounts {
  std::uint64_t complete_images = 0;
  std::uint64_t incomplete_images = 0;  ///< delivered, flagged
  std::uint64_t missed_images = 0;      ///< times that the camera's frame id jumped
  std::uint64_t underruns = 0;          ///< packets (USB: images) that found no free buffer
  std::uint64_t missing_packets = 0;    ///< of incomplete images, counted from the first gap to the image's end
  std::uint64_t resent_packets = 0;     ///< asked for again and come
  std::uint64_t broken_packets = 0;     ///< packets with an error code, and images larger than their buffer
};

/// Images of a GigE Vision or USB3 Vision camera, by Aravis. Packet::bytes is the header of image_packet.hpp and the
/// pixels, in the pooled buffer that the transport wrote: nothing is copied. Packet::received is the host's clock when
/// the last byte was here, read in the receiving thread (Aravis's own system stamp is the wall clock at the first
/// packet: it steps, and names another event).
///
/// open(): Unavailable if the camera is absent, silent or held by another program; Invalid if it is not the camera that
/// Config names or refuses a setting (a retry does not help). next(): incomplete images are handed on, flagged. Faults,
/// at most one of a kind a second, each with its count: Lost (incomplete images), Overflow (no buffer was free),
/// Malformed (packets in error). Wholly lost images show in the frame id and are counted by ImageDecoder. Disconnected
/// when the camera stops answering its heartbeat: 3 to 9 s after a GigE camera is gone, at once for a USB one.
///
/// Thread-bound. next() waits at most about 100 ms; open() and close() several seconds if the camera does not answer.
class AravisSource : public PacketSource {
 public:
  struct Config {
    SensorId sensor = 1;

    // Which camera. The first of address, id and serial that is set finds it; serial is checked in any case.
    std::string address;  ///< IPv4 address of a GigE camera
    std::string
        interface;       ///< own IPv4 address towards it, with `address` only; empty: the one on the camera's network
    std::string id;      ///< Aravis's name of it, as `arv-tool-0.8` lists it: maker-model-serial
    std::string serial;  ///< the camera's serial number

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
    int realtime_priority = 0;  ///< SCHED_RR of the receiving thread, 1 to 99; 0: normal. Without privilege: normal
    std::size_t stream_buffers = 8;     ///< images that the transport may be filling or hold ready
    std::size_t images_in_flight = 32;  ///< further images that recorder and pipeline may hold at a time
    /// Empty when fine, else a sentence that names the key and its range.
    std::string validate() const;
  };
  explicit AravisSource(Config config);
  ~AravisSource() override;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

  ImageStreamCounts counts() const;

 private:
  struct Open;  // the camera and its stream
  void look_for_losses(HostTime now, bool is_last);

  const Config config_;
  std::unique_ptr<Open> open_;
  ImageStreamCounts closed_;  // of streams that are over
};

}  // namespace hueline::drivers
