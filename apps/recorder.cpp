#include "apps/recorder.hpp"

namespace hueline::apps {

Status Recorder::take(const Packet& packet, std::chrono::nanoseconds now) {
  if (packet.sequence > next_sequence_) gaps_.push_back({taken_, packet.sequence - next_sequence_});
  next_sequence_ = packet.sequence + 1;
  ++taken_;
  is_resting_ = false;
  return journal_->append(packet, now);
}

Status Recorder::pause() {
  if (std::exchange(is_resting_, true)) return {};
  return journal_->sync();
}

std::uint64_t Recorder::end_sequence() const {
  const std::uint64_t recorded = packets_recorded();
  std::uint64_t end = recorded;
  for (const Gap& gap : gaps_)
    if (gap.packets_before < recorded) end += gap.size;
  return end;
}

}  // namespace hueline::apps
