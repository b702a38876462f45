#include "sim/devices/gvsp_stream.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "sim/devices/drive_clock.hpp"

namespace hueline::sim {
namespace {

constexpr std::int64_t kShortestPauseNs = 200'000;
constexpr std::uint32_t kUdpOverheadBytes = 28;

/// Sleeps until the link would have carried what was sent. Pauses that are too short for a sleep are left to add up.
bool pace(std::int64_t due_ns, const std::stop_token& stop) {
  const std::int64_t ahead = due_ns - monotonic_raw_ns();
  if (ahead < kShortestPauseNs) return !stop.stop_requested();
  const timespec pause{ahead / 1'000'000'000, ahead % 1'000'000'000};
  ::clock_nanosleep(CLOCK_MONOTONIC, 0, &pause, nullptr);
  return !stop.stop_requested();
}

}  // namespace

/// Collects packets that are due together and sends them in one system call, because a system call costs as much as
/// carrying a packet of 9000 bytes.
class GvspStream::Batch {
 public:
  static constexpr std::size_t kMost = 32;

  void add(const SentImage& sent, std::uint32_t packet_id, GvspStatus status) {
    Slot& slot = slots_[count_];
    std::span<const std::byte> data;
    if (status == GvspStatus::Unavailable) {
      slot.head = encode_gvsp_data_header(sent.image.block_id, packet_id, status);
    } else if (packet_id == 0) {
      slot.head = encode_gvsp_leader(sent.image, status);
    } else if (packet_id > gvsp_data_packets(sent.image, sent.packet_bytes)) {
      slot.head = encode_gvsp_trailer(sent.image, packet_id, status);
    } else {
      const std::size_t size = sent.packet_bytes - kGvspOverheadBytes;
      const std::size_t at = (packet_id - 1) * size;
      slot.head = encode_gvsp_data_header(sent.image.block_id, packet_id, status);
      data = sent.pixels.bytes().subspan(at, std::min(size, sent.pixels.size() - at));
    }
    slot.parts = {{{slot.head.data(), slot.head.size()}, {const_cast<std::byte*>(data.data()), data.size()}}};
    slot.to = sent.to;
    msghdr& message = messages_[count_++].msg_hdr;
    message = {};
    message.msg_name = &slot.to;
    message.msg_namelen = sizeof(slot.to);
    message.msg_iov = slot.parts.data();
    message.msg_iovlen = data.empty() ? 1 : 2;
  }
  bool is_full() const { return count_ == kMost; }
  std::size_t size() const { return count_; }

  /// Sends the packets and forgets them. Returns how many the kernel accepted. A packet that it refuses does not stop
  /// the others.
  std::uint64_t send(int socket) {
    std::uint64_t taken = 0;
    for (std::size_t at = 0; at < count_;) {
      const int n = ::sendmmsg(socket, messages_.data() + at, static_cast<unsigned>(count_ - at), MSG_NOSIGNAL);
      if (n > 0) taken += static_cast<std::uint64_t>(n);
      at += n > 0 ? static_cast<std::size_t>(n) : 1;
    }
    count_ = 0;
    return taken;
  }

 private:
  struct Slot {
    Bytes head;
    std::array<iovec, 2> parts{};
    sockaddr_in to{};
  };
  std::array<Slot, kMost> slots_;
  std::array<mmsghdr, kMost> messages_{};
  std::size_t count_ = 0;
};

std::string GvspStream::Config::validate() const {
  if (!(link_bytes_per_second >= 1e6))
    return fmt::format("link_bytes_per_second: {} is below 1e6", link_bytes_per_second);
  if (!(lost_packet_share >= 0 && lost_packet_share <= 1)) {
    return fmt::format("lost_packet_share: {} is not within 0 .. 1", lost_packet_share);
  }
  return {};
}

void GvspStream::set_target(const StreamTarget& target) {
  const int discover = target.may_fragment ? IP_PMTUDISC_DONT : IP_PMTUDISC_PROBE;
  ::setsockopt(socket_.get(), IPPROTO_IP, IP_MTU_DISCOVER, &discover, sizeof(discover));
  Lock lock(mutex_);
  if (target.is_active && !target_.is_active) ++acquisitions_;
  target_ = target;
}

bool GvspStream::is_active() const {
  Lock lock(mutex_);
  return target_.is_active;
}

GvspStream::Counts GvspStream::counts() const {
  Lock lock(mutex_);
  return counts_;
}

void GvspStream::send_test_packet() {
  Lock lock(mutex_);
  const StreamTarget stream = target_;
  lock.unlock();
  const Bytes packet(stream.packet_bytes - kUdpOverheadBytes);
  ::sendto(socket_.get(), packet.data(), packet.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
           reinterpret_cast<const sockaddr*>(&stream.to), sizeof(stream.to));
}

void GvspStream::send_again(const GvcpResend& request) {
  std::optional<SentImage> found;
  {
    Lock lock(mutex_);
    for (const SentImage& kept : kept_) {
      if (kept.image.block_id == request.block_id) found = kept;
    }
    if (!found) {
      ++counts_.resends_refused;
      found.emplace();
      found->image.block_id = request.block_id;
      found->to = target_.to;
    }
  }
  const bool is_there = found->has_pixels;
  const std::uint32_t trailer = is_there ? gvsp_data_packets(found->image, found->packet_bytes) + 1 : request.first;
  std::uint64_t sent = 0;
  Batch batch, refusals;
  const auto flush = [&] {
    sent += batch.send(socket_.get());
    refusals.send(socket_.get());
  };
  for (std::uint32_t id = request.first; id <= std::min(request.last, trailer); ++id) {
    const bool has_packet = is_there && (id == 0 || id == trailer || id > found->missing_packets);
    (has_packet ? batch : refusals).add(*found, id, has_packet ? GvspStatus::Resent : GvspStatus::Unavailable);
    if (batch.is_full() || refusals.is_full()) flush();
  }
  flush();
  Lock lock(mutex_);
  counts_.packets_resent += sent;
}

Status GvspStream::send(const CameraImage& image, const std::stop_token& stop) {
  Lock lock(mutex_);
  const StreamTarget stream = target_;
  const std::uint64_t acquisition = acquisitions_;
  lock.unlock();
  if (!stream.is_active) return Error{ErrorCode::Unavailable, "nobody has started the camera's acquisition"};
  Result<Buffer> pixels = cut_region(image, stream.region);
  if (!pixels) return pixels.error();

  // A camera numbers its images from 1 in each acquisition, and when it has restarted.
  if (acquisition != numbered_acquisition_ || image.sequence < last_sequence_) {
    numbered_acquisition_ = acquisition;
    first_sequence_ = image.sequence;
  }
  last_sequence_ = image.sequence;
  SentImage sent;
  sent.pixels = with_chunks(*pixels, image, stream.chunks);
  if (stream.chunks.is_active) sent.image.payload_type = config_.chunk_payload_type;
  sent.has_pixels = true;
  sent.to = stream.to;
  sent.packet_bytes = stream.packet_bytes;
  sent.missing_packets = image.missing_packets;
  sent.image.block_id = static_cast<std::uint16_t>((image.sequence - first_sequence_) % 65535 + 1);
  sent.image.timestamp = static_cast<std::uint64_t>(image.counter_ns);
  sent.image.pixel_format = stream.pixel_format;
  sent.image.width = image.ignores_region ? image.width : stream.region.width;
  sent.image.height = image.ignores_region ? image.height : stream.region.height;
  sent.image.offset_x = stream.region.offset_x;
  sent.image.offset_y = stream.region.offset_y;
  sent.image.payload_bytes = sent.pixels.size();
  lock.lock();
  kept_.push_back(sent);
  while (kept_.size() > config_.images_kept) kept_.pop_front();
  lock.unlock();

  const std::uint32_t trailer = gvsp_data_packets(sent.image, sent.packet_bytes) + 1;
  const double ns_per_packet = sent.packet_bytes * 1e9 / config_.link_bytes_per_second + stream.packet_delay_ns;
  const std::int64_t begin = monotonic_raw_ns();
  // The number of packets that the link carries in the shortest time that is worth a sleep.
  const auto burst =
      std::clamp<std::size_t>(static_cast<std::size_t>(kShortestPauseNs / ns_per_packet), 1, Batch::kMost);
  Batch batch;
  Counts made;
  bool is_stopped = false;
  for (std::uint32_t id = 0; id <= trailer && !is_stopped; ++id) {
    const bool is_data = id != 0 && id != trailer;
    const bool is_lost = is_data && (id <= sent.missing_packets ||
                                     (config_.lost_packet_share > 0 && losses_.uniform() < config_.lost_packet_share));
    if (is_lost)
      ++made.packets_lost_on_purpose;
    else
      batch.add(sent, id, GvspStatus::Success);
    if (batch.size() < burst && id != trailer) continue;
    const std::uint64_t offered = batch.size(), taken = batch.send(socket_.get());
    made.packets_sent += taken;
    made.packets_failed += offered - taken;
    is_stopped = !pace(begin + static_cast<std::int64_t>(ns_per_packet * (id + 1)), stop);
  }
  lock.lock();
  counts_.packets_sent += made.packets_sent;
  counts_.packets_failed += made.packets_failed;
  counts_.packets_lost_on_purpose += made.packets_lost_on_purpose;
  if (is_stopped) return Error{ErrorCode::Stopped, "stopped in the middle of an image"};
  return {};
}

}  // namespace hueline::sim
