#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "core/packet.hpp"
#include "drivers/gige/genicam_config.hpp"
#include "drivers/guest/packet_memory.hpp"

using ArvDevice = struct _ArvDevice;

namespace hueline::drivers {

/// What the stream has counted since the source was made, across all reopenings. Packets are those of the transport
/// (GVSP).
struct ImageStreamCounts {
  std::uint64_t complete_images = 0;
  std::uint64_t incomplete_images = 0;  ///< images that were delivered and marked as incomplete
  std::uint64_t missed_images = 0;      ///< jumps of the camera's frame id
  std::uint64_t underruns = 0;          ///< packets that found no free buffer
  /// Packets of incomplete images, counted from the first gap to the end of the image.
  std::uint64_t missing_packets = 0;
  std::uint64_t resent_packets = 0;  ///< packets that came after they were requested again
  std::uint64_t broken_packets = 0;  ///< packets with an error code, and images that are larger than their buffer
  /// Bytes that came and belong to no image: of images that were given up, or that are numbered below those before.
  std::uint64_t ignored_bytes = 0;
};

/// What an AravisSource gets from the process around it. Leave the members empty if the source is used alone.
struct AravisSurroundings {
  std::shared_ptr<PacketMemory> memory;  ///< where images are stored; if empty, the source makes a pool of its own
  /// Called when the camera is found and under our control, before any other access to it.
  std::function<void(ArvDevice&)> on_control;
};

/// Receives the images of a GigE Vision camera by means of Aravis.
///
/// Packet::bytes is the header of image_packet.hpp and then the pixels, in the memory into which the transport wrote
/// them; nothing is copied. Packet::received is the host's clock when the last byte had arrived, read in the receiving
/// thread. (Aravis's own system time stamp is not used: it is the wall clock at the first packet, so it may step, and
/// it names another event.)
///
/// Aravis 0.8.26 can abort the process when it loses a camera, and it reads beyond its memory on datagrams that no
/// camera sends (gvsp_filter.hpp keeps those away from it). So this class runs in hueline-guest, never in the program
/// that records.
///
/// Errors of open(): Unavailable if the camera is absent, silent or held by another program, or if this computer does
/// not have the address that `interface` names. Invalid if the camera is not the one that Config names, or refuses a
/// setting; asking again does not help.
/// Errors of next(): Disconnected when the camera stops answering its heartbeat, 3 to 9 s after it is gone, and an
/// image after a camera that has restarted counts its images from 1 again. Fault packets, at most one of each kind a
/// second, each with its count: Lost (incomplete images), Overflow (no buffer was free), Malformed (packets with
/// errors). Incomplete images are delivered and marked. Images that are lost entirely show as a gap in the frame id,
/// and ImageDecoder counts them.
///
/// Thread safety: none; one thread calls all functions. next() waits at most about 100 ms. open() and close() take
/// several seconds if the camera does not answer.
class AravisSource : public PacketSource {
 public:
  using Config = GenicamConfig;
  explicit AravisSource(Config config, AravisSurroundings surroundings = {});
  ~AravisSource() override;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

  /// Returns the counts of all streams so far.
  ImageStreamCounts counts() const;

 private:
  struct Open;  // the camera and its stream
  void look_for_restart(bool has_image);
  void look_for_losses(HostTime now, bool is_last);

  const Config config_;
  const AravisSurroundings surroundings_;
  const std::shared_ptr<PacketMemory> memory_;
  std::unique_ptr<Open> open_;
  ImageStreamCounts closed_;  // counts of the streams that are closed
};

}  // namespace hueline::drivers
