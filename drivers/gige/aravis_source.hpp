#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "core/packet.hpp"
#include "drivers/gige/genicam_config.hpp"
#include "drivers/guest/packet_memory.hpp"

using ArvDevice = struct _ArvDevice;

namespace hueline::drivers {

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

/// What surrounds an AravisSource, where it is not alone in its process.
struct AravisSurroundings {
  std::shared_ptr<PacketMemory> memory;  ///< for the images; empty: a pool of its own
  /// The camera is found and ours; called before anything else is asked of it.
  std::function<void(ArvDevice&)> on_control;
};

/// Images of a GigE Vision or USB3 Vision camera, by Aravis. Packet::bytes is the header of image_packet.hpp and the
/// pixels, in the memory that the transport wrote: nothing is copied. Packet::received is the host's clock when
/// the last byte was here, read in the receiving thread (Aravis's own system stamp is the wall clock at the first
/// packet: it steps, and names another event).
///
/// Aravis 0.8.26 can abort the process when it loses a camera, and reads beyond its memory on datagrams that no camera
/// sends (gvsp_filter.hpp keeps those from it): it runs in hueline-guest, never in a program that has more to lose.
///
/// open(): Unavailable if the camera is absent, silent or held by another program, or if this computer has not the
/// address that `interface` names; Invalid if it is not the camera that Config names or refuses a setting (a retry does
/// not help). next(): incomplete images are handed on, flagged. Faults, at most one of a kind a second, each with its
/// count: Lost (incomplete images), Overflow (no buffer was free), Malformed (packets in error). Wholly lost images
/// show in the frame id and are counted by ImageDecoder. Disconnected when the camera stops answering its heartbeat: 3
/// to 9 s after a GigE camera is gone, at once for a USB one.
///
/// Thread-bound. next() waits at most about 100 ms; open() and close() several seconds if the camera does not answer.
class AravisSource : public PacketSource {
 public:
  using Config = GenicamConfig;
  explicit AravisSource(Config config, SensorId sensor = 1, AravisSurroundings surroundings = {});
  ~AravisSource() override;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

  ImageStreamCounts counts() const;

 private:
  struct Open;  // the camera and its stream
  void look_for_losses(HostTime now, bool is_last);

  const Config config_;
  const SensorId sensor_;
  const AravisSurroundings surroundings_;
  const std::shared_ptr<PacketMemory> memory_;
  std::unique_ptr<Open> open_;
  ImageStreamCounts closed_;  // of streams that are over
};

}  // namespace hueline::drivers
