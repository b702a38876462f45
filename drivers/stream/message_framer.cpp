#include "drivers/stream/message_framer.hpp"

namespace hueline::drivers {
namespace {

// Long runs of garbage (a wrong baud rate, for example) are reported in pieces of this size, so that they are reported
// soon.
constexpr std::uint64_t kReportSkippedBytes = 4096;

}  // namespace

void MessageFramer::feed(std::span<const std::byte> bytes, HostTime received, Sink& sink) {
  if (bytes.empty()) return;
  fed_ += bytes.size();
  arrivals_.push_back({fed_, received});
  if (held_.size() == decided_) {
    const std::size_t done = scan(bytes, false, sink);
    held_.assign(bytes.begin() + static_cast<std::ptrdiff_t>(done), bytes.end());
    decided_ = 0;
    return;
  }
  held_.insert(held_.end(), bytes.begin(), bytes.end());
  decided_ += scan(std::span(held_).subspan(decided_), false, sink);
  // The rest is moved only when more than half is done, so that moving costs little for each byte.
  if (decided_ > held_.size() / 2) {
    held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(decided_));
    decided_ = 0;
  }
}

void MessageFramer::flush(Sink& sink) {
  scan(std::span(held_).subspan(decided_), true, sink);
  held_.clear();
  decided_ = 0;
  report_skipped(sink);
  is_boundary_ = true;
}

void MessageFramer::discard(Sink& sink) {
  skipped_ += held_.size() - decided_;
  position_ += held_.size() - decided_;
  held_.clear();
  decided_ = 0;
  report_skipped(sink);
  is_boundary_ = true;
}

MessageFramer::Found MessageFramer::judge(std::span<const std::byte> rest) {
  Found best;
  for (std::size_t form = 0; form < forms_.size(); ++form) {
    const Judgement judgement = forms_[form]->judge(rest, position_, is_boundary_);
    if (judgement.verdict == Judgement::Verdict::Whole) return {judgement, form};
    // NeedMore outweighs Broken: the form that waits may still be right.
    const auto weight = [](Judgement::Verdict verdict) {
      return verdict == Judgement::Verdict::Noise ? 0 : verdict == Judgement::Verdict::Broken ? 1 : 2;
    };
    if (weight(judgement.verdict) > weight(best.judgement.verdict)) best = {judgement, form};
  }
  return best;
}

std::size_t MessageFramer::scan(std::span<const std::byte> data, bool is_final, Sink& sink) {
  std::size_t at = 0;
  while (at < data.size()) {
    const std::span<const std::byte> rest = data.subspan(at);
    Found found = judge(rest);
    if (found.judgement.verdict == Judgement::Verdict::NeedMore && !is_final) return at;
    if (found.judgement.verdict == Judgement::Verdict::Whole) {
      report_skipped(sink);
      at += found.judgement.bytes;
      position_ += found.judgement.bytes;
      is_boundary_ = true;
      sink.on_message(found.form, rest.first(found.judgement.bytes), received_of_last());
      continue;
    }
    if (found.judgement.verdict == Judgement::Verdict::Broken ||
        (found.judgement.verdict == Judgement::Verdict::NeedMore && rest.size() >= 3 && skipped_ == 0))
      ++broken_;
    ++at;
    ++position_;
    is_boundary_ = false;
    if (++skipped_ == kReportSkippedBytes) report_skipped(sink);
  }
  return at;
}

void MessageFramer::report_skipped(Sink& sink) {
  if (skipped_ == 0) return;
  sink.on_skipped(skipped_, broken_, received_of_last());
  skipped_ = broken_ = 0;
}

/// Returns the arrival of the last byte that was decided.
HostTime MessageFramer::received_of_last() {
  // Bytes are decided in their order, so the arrivals of earlier bytes are not needed again.
  while (arrivals_.size() > 1 && arrivals_.front().end < position_) arrivals_.pop_front();
  return arrivals_.empty() ? HostTime{} : arrivals_.front().received;
}

}  // namespace hueline::drivers
