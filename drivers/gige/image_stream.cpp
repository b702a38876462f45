#include "drivers/gige/image_stream.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/socket.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "drivers/gige/gvsp_filter.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {

namespace {

// Size of the socket buffer that is requested. The kernel gives at most net.core.rmem_max.
constexpr gint kLargeSocketBuffer = 64 << 20;

void delete_memory(gpointer memory) { delete static_cast<MutableBuffer*>(memory); }

MutableBuffer& memory_of(ArvBuffer* buffer) {
  return *static_cast<MutableBuffer*>(const_cast<void*>(arv_buffer_get_user_data(buffer)));
}

ImageStatus status_of(ArvBuffer* buffer) {
  // A fresh buffer has no payload type until its leader arrives.
  if (arv_buffer_get_payload_type(buffer) == ARV_BUFFER_PAYLOAD_TYPE_UNKNOWN) return ImageStatus::NoLeader;
  switch (arv_buffer_get_status(buffer)) {
    case ARV_BUFFER_STATUS_SUCCESS:
      return ImageStatus::Complete;
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return ImageStatus::MissingPackets;
    case ARV_BUFFER_STATUS_TIMEOUT:
      return ImageStatus::TimedOut;
    default:
      return ImageStatus::Broken;
  }
}

/// Aravis knows only the chunks of GigE Vision 2.x; before, they were a type of payload.
bool has_chunks(ArvBuffer* buffer) {
  return arv_buffer_has_chunks(buffer) ||
         arv_buffer_get_payload_type(buffer) == ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA;
}

void set_region(ImageHeader& header, gint x, gint y, gint width, gint height, ArvPixelFormat pfnc) {
  header.offset_x = static_cast<std::uint32_t>(x);
  header.offset_y = static_cast<std::uint32_t>(y);
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.pfnc = pfnc;
  // Bits 16 to 23 of a PFNC code are the number of bits of one pixel.
  header.stride = (header.width * (pfnc >> 16 & 0xFF) + 7) / 8;
}

/// Installs filters, so that the kernel passes to Aravis only packets of an image of `payload` bytes. Call it while the
/// stream has no buffers: until then Aravis drops every packet.
Status guard(ArvCamera* camera, ArvStream* stream, std::size_t payload) {
  auto* const device = ARV_GV_DEVICE(arv_camera_get_device(camera));
  GError* error = nullptr;
  GvspStreamShape shape;
  shape.camera = ipv4_of(arv_gv_device_get_device_address(device)).sin_addr;
  shape.own = ipv4_of(arv_gv_device_get_interface_address(device)).sin_addr;
  shape.own_port = arv_gv_stream_get_port(ARV_GV_STREAM(stream));
  shape.payload_bytes = payload;
  shape.packet_bytes = arv_gv_device_get_packet_size(device, &error);
  if (error) return take_error("read the packet size", error);
  if (shape.packet_bytes < 100 || shape.packet_bytes > 65'535)
    return Error{ErrorCode::Invalid,
                 fmt::format("packet_size: the camera's packets have {} bytes", shape.packet_bytes)};

  const auto sockets = own_sockets(AF_INET, SOCK_DGRAM);
  const auto udp =
      std::ranges::find_if(sockets, [&](int fd) { return ntohs(bound_address(fd).sin_port) == shape.own_port; });
  if (udp == sockets.end()) return Error{ErrorCode::Io, "camera: the stream has no socket that could be guarded"};
  // The receiving thread is stopped, what came before the filter is discarded, and the thread starts again.
  arv_stream_stop_thread(stream, FALSE);
  if (const Status attached = attach_filter(*udp, gvsp_filter_of_udp_socket(shape)); !attached) return attached;
  for (char byte = 0; ::recv(*udp, &byte, 1, MSG_DONTWAIT | MSG_TRUNC) >= 0;) continue;
  arv_stream_start_thread(stream);
  for (const int fd : own_sockets(AF_PACKET, SOCK_RAW)) {
    if (const Status attached = attach_filter(fd, gvsp_filter_of_packet_socket(shape)); !attached) return attached;
    // Aravis reads the packet socket now. Without this filter the UDP socket would fill with a second copy that nobody
    // reads.
    if (const Status attached = attach_filter(*udp, filter_of_nothing()); !attached) return attached;
    // The ring of the packet socket delivers what came before the filter within 5 ms.
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
  }
  return {};
}

}  // namespace

ImageStream::ImageStream(const AravisSource::Config& config, PacketMemory& memory, std::size_t payload)
    : config_(config), payload_(payload), memory_(memory) {}

Result<std::unique_ptr<ImageStream>> ImageStream::start(ArvCamera* camera, const AravisSource::Config& config,
                                                        PacketMemory& memory) {
  GError* error = nullptr;
  const guint payload = arv_camera_get_payload(camera, &error);
  if (error) return take_error("read the image size", error);
  gint x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(camera, &x, &y, &width, &height, &error);
  if (error) return take_error("read the region", error);
  if (const Status prepared = memory.prepare(kImageHeaderSize + payload); !prepared) return prepared.error();
  std::unique_ptr<ImageStream> stream(new ImageStream(config, memory, payload));
  set_region(stream->expected_, x, y, width, height, pfnc_code(config.pixel_format));
  if (config.chunks) stream->chunks_ = ChunkReader::make(camera, std::endian::big);
  stream->owned_stream_.reset(arv_camera_create_stream(camera, &ImageStream::on_event, stream.get(), &error));
  if (error) return take_error("open the image stream", error);
  if (!stream->owned_stream_) return Error{ErrorCode::Unavailable, "camera: no image stream"};
  const guint give_up_us = static_cast<guint>(config.give_up_after.count() * 1000);
  // The size is fixed, whatever the size of an image: on a busy machine a burst must last until the receiving thread
  // runs.
  const gint socket_buffer =
      config.socket_buffer_bytes ? static_cast<gint>(config.socket_buffer_bytes) : kLargeSocketBuffer;
  g_object_set(stream->owned_stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
               socket_buffer, "packet-resend",
               config.packet_resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
               "frame-retention", give_up_us, nullptr);
  if (const Status guarded = guard(camera, stream->owned_stream_.get(), payload); !guarded) return guarded.error();
  stream->stream_ = stream->owned_stream_.get();
  if (!stream->top_up()) return Error{ErrorCode::Exhausted, "camera: no memory for images"};
  arv_camera_start_acquisition(camera, &error);
  if (error) return take_error("start the acquisition", error);
  return stream;
}

ImageStream::~ImageStream() { stop(); }

// Joins the receiving thread. While it ends, its last images still come to on_event().
void ImageStream::stop() { owned_stream_.reset(); }

bool ImageStream::top_up() {
  while (given_ < config_.stream_buffers) {
    MutableBuffer memory = memory_.acquire(kImageHeaderSize + payload_);
    if (!memory) return false;
    std::byte* pixels = memory.data() + kImageHeaderSize;
    auto* kept = new MutableBuffer(std::move(memory));
    ++given_;
    arv_stream_push_buffer(stream_, arv_buffer_new_full(payload_, pixels, kept, &delete_memory));
  }
  return true;
}

void ImageStream::on_event(void* self, ArvStreamCallbackType type, ArvBuffer*) {
  auto& stream = *static_cast<ImageStream*>(self);
  switch (type) {
    case ARV_STREAM_CALLBACK_TYPE_INIT:
      ::pthread_setname_np(::pthread_self(), "camera-receive");
      if (stream.config_.realtime_priority > 0) arv_make_thread_realtime(stream.config_.realtime_priority);
      break;
    // The buffer is taken from the output queue here and not by the reader. Aravis queues a buffer before it calls
    // back, so the reader could free it while Aravis still uses it for the callback.
    case ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE:
      stream.take_finished();
      break;
    case ARV_STREAM_CALLBACK_TYPE_START_BUFFER:
    case ARV_STREAM_CALLBACK_TYPE_EXIT:
      break;
  }
}

void ImageStream::take_finished() {
  const HostTime now = host_now();
  ArvStream* stream = stream_;  // read first, so that everything that start() wrote before it is visible too
  const std::uint64_t missing = info("n_missing_packets");
  while (ArvBuffer* buffer = arv_stream_try_pop_buffer(stream)) {
    --given_;
    Lock lock(mutex_);
    finished_.push_back({GRef<ArvBuffer>(buffer), now, missing});
  }
  changed_.notify_one();
}

std::optional<ImageStream::Done> ImageStream::wait(std::chrono::milliseconds wait, std::stop_token stop) {
  Finished done;
  {
    Lock lock(mutex_);
    if (!changed_.wait_for(lock, stop, wait,
                           [&]() HUELINE_REQUIRES(mutex_) { return !finished_.empty() || is_interrupted_; }) ||
        finished_.empty())
      return std::nullopt;
    done = std::move(finished_.front());
    finished_.pop_front();
  }
  const std::uint64_t missing = done.missing_packets - std::exchange(missing_packets_, done.missing_packets);
  ImageHeader header = describe(done.buffer.get(), missing);
  if (chunks_ && header.status == ImageStatus::Complete && has_chunks(done.buffer.get())) {
    std::size_t size = 0;
    const auto* payload = static_cast<const std::byte*>(arv_buffer_get_data(done.buffer.get(), &size));
    chunks_->read({payload, size}, header);
  }
  MutableBuffer memory = std::move(memory_of(done.buffer.get()));
  done.buffer.reset();
  encode_image_header(header, std::span<std::byte, kImageHeaderSize>(memory.data(), kImageHeaderSize));
  const std::uint64_t pixels =
      header.status == ImageStatus::NoLeader ? payload_ : std::min<std::uint64_t>(header.pixel_bytes(), payload_);
  memory.resize(kImageHeaderSize + pixels);
  return Done{done.at, header, std::move(memory).share()};
}

ImageHeader ImageStream::describe(ArvBuffer* buffer, std::uint64_t missing_packets) const {
  const ImageStatus status = status_of(buffer);
  if (status == ImageStatus::NoLeader)
    return {.status = status, .missing_packets = static_cast<std::uint32_t>(missing_packets)};
  // Aravis gives the region of complete images only. An incomplete image gets the region that the camera was set to.
  ImageHeader header = expected_;
  header.status = status;
  header.frame_id = arv_buffer_get_frame_id(buffer);
  // If the camera has no tick frequency, Aravis puts the wall clock there, which is not the camera's counter.
  if (const guint64 stamp = arv_buffer_get_timestamp(buffer); stamp != arv_buffer_get_system_timestamp(buffer))
    header.time = DeviceTime<CameraCounter>(nanoseconds(static_cast<std::int64_t>(stamp)));
  if (status != ImageStatus::Complete) {
    header.missing_packets = static_cast<std::uint32_t>(missing_packets);
    return header;
  }
  const auto type = arv_buffer_get_payload_type(buffer);
  if (arv_buffer_get_n_parts(buffer) != 1 ||
      (type != ARV_BUFFER_PAYLOAD_TYPE_IMAGE && type != ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA)) {
    header.status = ImageStatus::Broken;
    return header;
  }
  gint x = 0, y = 0, width = 0, height = 0, x_padding = 0, y_padding = 0;
  arv_buffer_get_image_region(buffer, &x, &y, &width, &height);
  arv_buffer_get_image_padding(buffer, &x_padding, &y_padding);
  set_region(header, x, y, width, height, arv_buffer_get_image_pixel_format(buffer));
  header.stride += static_cast<std::uint32_t>(x_padding);
  std::size_t received = 0;
  if (!arv_buffer_get_image_data(buffer, &received) || received < header.pixel_bytes())
    header.status = ImageStatus::Broken;
  return header;
}

void ImageStream::interrupt() {
  {
    Lock lock(mutex_);
    is_interrupted_ = true;
  }
  changed_.notify_all();
}

std::uint64_t ImageStream::info(const char* name) const { return arv_stream_get_info_uint64_by_name(stream_, name); }

ImageStreamCounts ImageStream::counts() const {
  return {.complete_images = info("n_completed_buffers"),
          .incomplete_images = info("n_failures"),
          .missed_images = info("n_missing_frames"),
          .underruns = info("n_underruns"),
          .missing_packets = info("n_missing_packets"),
          .resent_packets = info("n_resent_packets"),
          .broken_packets = info("n_error_packets") + info("n_size_mismatch_errors"),
          .ignored_bytes = info("n_ignored_bytes")};
}

}  // namespace hueline::drivers
