#include "drivers/gige/aravis_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "drivers/gige/aravis_camera.hpp"
#include "drivers/gige/image_stream.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {

namespace {

constexpr std::chrono::milliseconds kWait{100};
constexpr nanoseconds kBetweenFaults = std::chrono::seconds(1);

ImageStreamCounts operator+(const ImageStreamCounts& a, const ImageStreamCounts& b) {
  return {.complete_images = a.complete_images + b.complete_images,
          .incomplete_images = a.incomplete_images + b.incomplete_images,
          .missed_images = a.missed_images + b.missed_images,
          .underruns = a.underruns + b.underruns,
          .missing_packets = a.missing_packets + b.missing_packets,
          .resent_packets = a.resent_packets + b.resent_packets,
          .broken_packets = a.broken_packets + b.broken_packets,
          .ignored_bytes = a.ignored_bytes + b.ignored_bytes};
}

/// Images in a pool of this process.
class PooledMemory final : public PacketMemory {
 public:
  explicit PooledMemory(std::size_t packets) : packets_(packets) {}
  Status prepare(std::size_t packet_bytes) override {
    pool_.emplace(std::bit_ceil(packet_bytes) * packets_);
    return {};
  }
  MutableBuffer acquire(std::size_t bytes) override { return pool_->acquire(bytes); }
  std::size_t bytes_in_use() const override { return pool_->bytes_in_use(); }
  std::size_t limit_bytes() const override { return pool_->limit_bytes(); }

 private:
  const std::size_t packets_;
  std::optional<BufferPool> pool_;
};

void on_control_lost(ArvDevice*, gpointer stream) { static_cast<ImageStream*>(stream)->interrupt(); }

}  // namespace

struct AravisSource::Open {
  GRef<ArvCamera> camera;
  std::unique_ptr<ImageStream> stream;
  ImageStreamCounts told;  // counts of losses that faults have already reported
  HostTime last_look{};
  ImageStreamCounts at_image;  // counts when an image came last
  bool counts_anew = false;    // the camera has restarted, and the stream ignores its images
  std::deque<Packet> faults;   // faults that next() still has to return

  // Releasing the camera object joins the heartbeat thread. Until then that thread may report to `stream` that the
  // camera is gone, so the stream is stopped here but outlives the camera object.
  ~Open() {
    if (!stream) return;
    if (!stream->is_interrupted()) arv_camera_stop_acquisition(camera.get(), nullptr);
    stream->stop();
    camera.reset();
  }
};

AravisSource::AravisSource(Config config, AravisSurroundings surroundings)
    : config_(std::move(config)),
      surroundings_(std::move(surroundings)),
      memory_(surroundings_.memory
                  ? surroundings_.memory
                  : std::make_shared<PooledMemory>(config_.stream_buffers + config_.images_in_flight)) {}
AravisSource::~AravisSource() { close(); }

Status AravisSource::open() {
  close();
  auto camera = connect_camera(config_, surroundings_.on_control);
  if (!camera) return camera.error();
  if (const Status configured = configure_camera(camera->get(), config_); !configured) return configured;
  auto stream = ImageStream::start(camera->get(), config_, *memory_);
  if (!stream) return stream.error();
  open_ = std::make_unique<Open>();
  open_->camera = std::move(*camera);
  open_->stream = std::move(*stream);
  open_->last_look = host_now();
  ArvDevice* device = arv_camera_get_device(open_->camera.get());
  g_signal_connect(device, "control-lost", G_CALLBACK(on_control_lost), open_->stream.get());
  // The camera may have been lost before the signal was connected.
  if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device))) open_->stream->interrupt();
  return {};
}

Result<Packet> AravisSource::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (!open_) return Error{ErrorCode::Disconnected, "camera: not open"};
  ImageStream& stream = *open_->stream;
  if (open_->faults.empty() && !open_->counts_anew) {
    // If the pool is exhausted, the stream gets no buffers, and its underruns are reported.
    (void)stream.top_up();
    auto image = stream.wait(kWait, stop);
    const bool is_last = !image && stream.is_interrupted();
    look_for_restart(image.has_value());
    look_for_losses(host_now(), is_last);
    if (image) return Packet{kSystemSensor, PacketKind::Wire, false, 0, image->received, std::move(image->packet)};
  }
  if (!open_->faults.empty()) {
    Packet fault = std::move(open_->faults.front());
    open_->faults.pop_front();
    return fault;
  }
  if (stream.is_interrupted()) return Error{ErrorCode::Disconnected, "camera: no longer answers"};
  if (open_->counts_anew) return Error{ErrorCode::Disconnected, "camera: counts its images anew"};
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  return Error{ErrorCode::TimedOut, {}};
}

/// A camera that has restarted counts its images anew. Aravis takes those numbered below the last for late ones and
/// ignores up to a hundred of them, so the stream must be opened again.
void AravisSource::look_for_restart(bool has_image) {
  const ImageStreamCounts seen = open_->stream->counts();
  ImageStreamCounts& before = open_->at_image;
  if (has_image || seen.incomplete_images != before.incomplete_images || seen.underruns != before.underruns)
    before = seen;
  const std::uint64_t ignored = (seen.ignored_bytes - before.ignored_bytes) / open_->stream->payload_bytes();
  if (ignored == 0) return;
  open_->faults.push_back(fault_packet(host_now(), FaultKind::Lost, ignored,
                                       "images are numbered below those before: the camera has restarted"));
  open_->counts_anew = true;
}

void AravisSource::look_for_losses(HostTime now, bool is_last) {
  if (!is_last && now - open_->last_look < kBetweenFaults) return;
  open_->last_look = now;
  const ImageStreamCounts seen = open_->stream->counts(), told = std::exchange(open_->told, seen);
  const auto fault = [&](FaultKind kind, std::uint64_t count, std::string detail) {
    if (count > 0) open_->faults.push_back(fault_packet(now, kind, count, std::move(detail)));
  };
  const std::uint64_t incomplete = seen.incomplete_images - told.incomplete_images;
  fault(FaultKind::Lost, incomplete,
        fmt::format("{} images incomplete: {} packets missing, {} came when asked for again", incomplete,
                    seen.missing_packets - told.missing_packets, seen.resent_packets - told.resent_packets));
  fault(FaultKind::Overflow, seen.underruns - told.underruns,
        fmt::format("packets of images found no free buffer: {} of {} MB are held, so recorder or pipeline is behind "
                    "(images_in_flight)",
                    memory_->bytes_in_use() >> 20, memory_->limit_bytes() >> 20));
  fault(FaultKind::Malformed, seen.broken_packets - told.broken_packets,
        "packets in error, or images larger than the camera announced");
}

void AravisSource::close() {
  if (!open_) return;
  closed_ = counts();
  open_.reset();
}

ImageStreamCounts AravisSource::counts() const { return open_ ? closed_ + open_->stream->counts() : closed_; }

}  // namespace hueline::drivers
