#include "drivers/transport/tcp_streams.hpp"

#include <algorithm>
#include <utility>

namespace hueline::drivers {
namespace {

constexpr std::size_t kMostFlows = 256, kMostWaitingBytes = 256 << 10, kMostWaiting = 1024;
/// A sequence number that is so far from the expected one belongs to another connection: no window is so large.
constexpr std::int64_t kFarthest = std::int64_t{1} << 30;

}  // namespace

TcpStreams::State& TcpStreams::state_of(const TcpFlow& flow) {
  if (const auto known = flows_.find(flow); known != flows_.end()) return known->second;
  if (flows_.size() >= kMostFlows) {
    const auto oldest = std::ranges::min_element(flows_, {}, [](const auto& one) { return one.second.used; });
    close(oldest->first, oldest->second);
    flows_.erase(oldest);
  }
  return flows_[flow];
}

void TcpStreams::begin(State& state, std::uint32_t sequence) {
  // One turn of the 32-bit number lies before the first byte, so that earlier positions are not negative.
  state.first = state.next = (std::uint64_t{1} << 32) + sequence;
}

void TcpStreams::take(const TcpSegment& segment, HostTime time) {
  if (segment.payload.empty() && segment.cut_off == 0 && !segment.is_first) return;
  const TcpFlow flow{segment.source, segment.destination, segment.source_port, segment.destination_port};
  State& state = state_of(flow);
  state.used = ++segments_;
  const std::uint32_t sequence = segment.sequence + (segment.is_first ? 1u : 0u);
  if (state.first == 0) begin(state, sequence);
  const auto ahead = static_cast<std::int32_t>(sequence - static_cast<std::uint32_t>(state.next));
  const bool is_far = ahead > kFarthest || ahead < -kFarthest;
  if (is_far || (segment.is_first && sequence != static_cast<std::uint32_t>(state.first))) {
    close(flow, state);
    begin(state, sequence);
    state.is_interrupted = true;
    state.missing = 0;
  }
  if (segment.is_first && state.next == state.first) state.is_beginning = true;
  const std::uint64_t at = state.next + static_cast<std::uint64_t>(static_cast<std::int64_t>(static_cast<std::int32_t>(
                                            sequence - static_cast<std::uint32_t>(state.next))));
  if (at <= state.next) {
    deliver(flow, state, time, at, segment.payload, segment.cut_off);
  } else {
    auto& waiting = state.waiting[at];
    if (waiting.bytes.size() + waiting.cut_off >= segment.payload.size() + segment.cut_off) {
      repeated_ += segment.payload.size();
    } else {
      repeated_ += waiting.bytes.size();
      state.waiting_bytes += segment.payload.size() - waiting.bytes.size();
      waiting = {time, {segment.payload.begin(), segment.payload.end()}, segment.cut_off};
    }
  }
  release(flow, state, false);
}

/// Delivers bytes that begin at or before the next position, without those that were delivered already.
void TcpStreams::deliver(const TcpFlow& flow, State& state, HostTime time, std::uint64_t at,
                         std::span<const std::byte> bytes, std::size_t cut_off) {
  const std::uint64_t known = std::min<std::uint64_t>(state.next - at, bytes.size());
  repeated_ += known;
  const auto fresh = bytes.subspan(static_cast<std::size_t>(known));
  state.newest = std::max(state.newest, time);
  if (!fresh.empty()) {
    state.next += fresh.size();
    ready_.push_back({flow,
                      state.newest,
                      std::exchange(state.is_beginning, false),
                      std::exchange(state.is_interrupted, false),
                      std::exchange(state.missing, 0),
                      {fresh.begin(), fresh.end()}});
  }
  const std::uint64_t end = at + bytes.size() + cut_off;
  if (cut_off == 0 || end <= state.next) return;
  state.missing += end - state.next;
  state.is_interrupted = true;
  state.next = end;
}

/// Delivers what waits and is in order now. If `gives_up` is set or too much waits, what lies before it is missing.
void TcpStreams::release(const TcpFlow& flow, State& state, bool gives_up) {
  while (!state.waiting.empty()) {
    const auto first = state.waiting.begin();
    const bool is_full = state.waiting_bytes > kMostWaitingBytes || state.waiting.size() > kMostWaiting;
    if (first->first > state.next) {
      if (!gives_up && !is_full) return;
      state.missing += first->first - state.next;
      state.is_interrupted = true;
      state.next = first->first;
    }
    const auto node = state.waiting.extract(first);
    state.waiting_bytes -= node.mapped().bytes.size();
    deliver(flow, state, node.mapped().time, node.key(), node.mapped().bytes, node.mapped().cut_off);
  }
}

/// Ends a flow: what waits is delivered, and what is missing at its end is told.
void TcpStreams::close(const TcpFlow& flow, State& state) {
  release(flow, state, true);
  if (state.missing > 0) ready_.push_back({flow, state.newest, false, true, std::exchange(state.missing, 0), {}});
  state.is_interrupted = false;
}

std::optional<TcpPiece> TcpStreams::next() {
  if (ready_.empty()) return {};
  TcpPiece piece = std::move(ready_.front());
  ready_.pop_front();
  return piece;
}

void TcpStreams::finish() {
  for (auto& [flow, state] : flows_) close(flow, state);
  flows_.clear();
}

}  // namespace hueline::drivers
