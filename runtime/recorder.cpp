#include "runtime/recorder.hpp"

namespace hueline::runtime {

Status Recorder::take(const Packet& packet, std::chrono::nanoseconds now) {
  if (packet.sequence > next_sequence_) gaps_.push_back({taken_, packet.sequence - next_sequence_});
  next_sequence_ = packet.sequence + 1;
  ++taken_;
  if (Status done = journal_->append(packet, now); !done) return done;
  return look_sometimes(now);
}

Status Recorder::rest(std::chrono::nanoseconds now) {
  if (Status done = journal_->write_due(now); !done) return done;
  return look_sometimes(now);
}

Status Recorder::look_sometimes(std::chrono::nanoseconds now) {
  if (looked_ && now - *looked_ < kLookEvery) return {};
  looked_ = now;
  return look();
}

/// Checks where the file is. Returns an error only if writing on is useless.
Status Recorder::look() {
  const Status place = journal_->check_place();
  if (place.ok() || place.error().code != ErrorCode::Unavailable) return place;
  if (place_.ok()) place_ = place;
  return {};
}

Status Recorder::close() {
  const Status looked = look();
  const Status closed = journal_->close();
  return looked.ok() ? closed : looked;
}

std::uint64_t Recorder::end_sequence() const {
  const std::uint64_t recorded = packets_recorded();
  std::uint64_t end = recorded;
  for (const Gap& gap : gaps_)
    if (gap.packets_before < recorded) end += gap.size;
  return end;
}

}  // namespace hueline::runtime
