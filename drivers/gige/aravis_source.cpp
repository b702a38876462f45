#include "drivers/gige/aravis_source.hpp"

#include <fmt/format.h>

#include <deque>

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
          .broken_packets = a.broken_packets + b.broken_packets};
}

bool is_ipv4(const std::string& text) {
  const GRef<GInetAddress> address(g_inet_address_new_from_string(text.c_str()));
  return address && g_inet_address_get_family(address.get()) == G_SOCKET_FAMILY_IPV4;
}

void on_control_lost(ArvDevice*, gpointer stream) { static_cast<ImageStream*>(stream)->interrupt(); }

}  // namespace

struct AravisSource::Open {
  GRef<ArvCamera> camera;
  std::unique_ptr<ImageStream> stream;
  ImageStreamCounts told;  // losses up to here have been reported
  HostTime last_look{};
  std::deque<Packet> faults;  // to be handed on

  // The heartbeat thread may be telling `stream` that the camera is gone until the camera object, which joins it, is
  // released.
  ~Open() {
    if (!stream) return;
    if (!stream->is_interrupted()) arv_camera_stop_acquisition(camera.get(), nullptr);
    stream->stop();
    camera.reset();
  }
};

AravisSource::AravisSource(Config config) : config_(std::move(config)) {}
AravisSource::~AravisSource() { close(); }

std::string AravisSource::Config::validate() const {
  constexpr std::uint32_t kLargestSide = 65536;
  if (address.empty() && id.empty() && serial.empty()) return "address, id, serial: one of them must name the camera";
  if (!interface.empty() && (address.empty() || !is_ipv4(address) || !is_ipv4(interface)))
    return fmt::format("interface: '{}' and address: '{}' must both be IPv4 addresses", interface, address);
  if ((width == 0) != (height == 0)) return "width, height: both or neither";
  if (width > kLargestSide || height > kLargestSide)
    return fmt::format("width, height: {} x {} is not within 0 to {} pixels", width, height, kLargestSide);
  if (width == 0 && (offset_x || offset_y)) return "offset_x, offset_y: only together with width and height";
  if (exposure && (*exposure < std::chrono::microseconds(1) || *exposure > std::chrono::seconds(10)))
    return fmt::format("exposure: {} ns is not within 1 us to 10 s", exposure->count());
  if (frame_rate_hz < 0 || frame_rate_hz > 10'000)
    return fmt::format("frame_rate_hz: {} is not within 0 to 10000 Hz", frame_rate_hz);
  if (frame_rate_hz > 0 && !trigger_source.empty()) return "frame_rate_hz, trigger_source: not both";
  if (packet_size != 0 && (packet_size < 576 || packet_size > 16'000))
    return fmt::format("packet_size: {} is not 0 or within 576 to 16000 bytes", packet_size);
  if (packet_delay < nanoseconds(0) || packet_delay > std::chrono::milliseconds(10))
    return fmt::format("packet_delay: {} ns is not within 0 to 10 ms", packet_delay.count());
  if (give_up_after < std::chrono::milliseconds(10) || give_up_after > std::chrono::seconds(10))
    return fmt::format("give_up_after: {} ms is not within 10 ms to 10 s", give_up_after.count());
  if (socket_buffer_bytes > 1u << 30)
    return fmt::format("socket_buffer_bytes: {} is not within 0 to {}", socket_buffer_bytes, 1u << 30);
  if (realtime_priority < 0 || realtime_priority > 99)
    return fmt::format("realtime_priority: {} is not within 0 to 99", realtime_priority);
  if (stream_buffers < 2 || stream_buffers > 1000)
    return fmt::format("stream_buffers: {} is not within 2 to 1000", stream_buffers);
  if (images_in_flight < 1 || images_in_flight > 10'000)
    return fmt::format("images_in_flight: {} is not within 1 to 10000", images_in_flight);
  return {};
}

Status AravisSource::open() {
  close();
  auto camera = connect_camera(config_);
  if (!camera) return camera.error();
  if (const Status configured = configure_camera(camera->get(), config_); !configured) return configured;
  auto stream = ImageStream::start(camera->get(), config_);
  if (!stream) return stream.error();
  open_ = std::make_unique<Open>();
  open_->camera = std::move(*camera);
  open_->stream = std::move(*stream);
  open_->last_look = host_now();
  ArvDevice* device = arv_camera_get_device(open_->camera.get());
  g_signal_connect(device, "control-lost", G_CALLBACK(on_control_lost), open_->stream.get());
  // Lost before anybody listened.
  if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device))) open_->stream->interrupt();
  return {};
}

Result<Packet> AravisSource::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (!open_) return Error{ErrorCode::Disconnected, "camera: not open"};
  ImageStream& stream = *open_->stream;
  if (open_->faults.empty()) {
    // If the pool is exhausted the stream runs dry, and its underruns are what is reported.
    (void)stream.top_up();
    auto image = stream.wait(kWait, stop);
    const bool is_last = !image && stream.is_interrupted();
    look_for_losses(host_now(), is_last);
    if (image) return Packet{config_.sensor, PacketKind::Wire, false, 0, image->received, std::move(image->packet)};
  }
  if (!open_->faults.empty()) {
    Packet fault = std::move(open_->faults.front());
    open_->faults.pop_front();
    return fault;
  }
  if (stream.is_interrupted()) return Error{ErrorCode::Disconnected, "camera: no longer answers"};
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  return Error{ErrorCode::TimedOut, {}};
}

void AravisSource::look_for_losses(HostTime now, bool is_last) {
  if (!is_last && now - open_->last_look < kBetweenFaults) return;
  open_->last_look = now;
  const ImageStreamCounts seen = open_->stream->counts(), told = std::exchange(open_->told, seen);
  const auto fault = [&](FaultKind kind, std::uint64_t count, std::string detail) {
    if (count == 0) return;
    const Fault made{config_.sensor, kind, now, count, std::move(detail)};
    open_->faults.push_back({config_.sensor, PacketKind::Fault, false, 0, now, Buffer::copy_of(encode_fault(made))});
  };
  const std::uint64_t incomplete = seen.incomplete_images - told.incomplete_images;
  fault(FaultKind::Lost, incomplete,
        fmt::format("{} images incomplete: {} packets missing, {} came when asked for again", incomplete,
                    seen.missing_packets - told.missing_packets, seen.resent_packets - told.resent_packets));
  const BufferPool& pool = open_->stream->pool();
  fault(FaultKind::Overflow, seen.underruns - told.underruns,
        fmt::format("packets of images found no free buffer: {} of {} MB are held, so recorder or pipeline is behind "
                    "(images_in_flight)",
                    pool.bytes_in_use() >> 20, pool.limit_bytes() >> 20));
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
