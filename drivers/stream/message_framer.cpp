#include "drivers/stream/message_framer.hpp"

namespace hueline::drivers {
namespace {

// Long runs of garbage (a wrong baud rate, for example) are reported in pieces of this size, so that they are reported
// soon.
constexpr std::uint64_t kReportSkippedBytes = 4096;

}  // namespace

void MessageFramer::feed(std::span<const std::byte> bytes, HostTime received, Sink& sink) {
  bytes_.feed(bytes, received, [&](std::span<const std::byte> data) { return scan(data, false, sink); });
}

void MessageFramer::flush(Sink& sink) {
  bytes_.flush([&](std::span<const std::byte> data) { return scan(data, true, sink); });
  report_skipped(sink);
  is_boundary_ = true;
}

void MessageFramer::discard(Sink& sink) {
  skipped_ += bytes_.discard();
  report_skipped(sink);
  is_boundary_ = true;
}

MessageFramer::Found MessageFramer::judge(std::span<const std::byte> rest) {
  Found best;
  for (std::size_t form = 0; form < forms_.size(); ++form) {
    const Judgement judgement = forms_[form]->judge(rest, bytes_.position(), is_boundary_);
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
      bytes_.decided(found.judgement.bytes);
      is_boundary_ = true;
      sink.on_message(found.form, rest.first(found.judgement.bytes), bytes_.received_of_last());
      continue;
    }
    if (found.judgement.verdict == Judgement::Verdict::Broken ||
        (found.judgement.verdict == Judgement::Verdict::NeedMore && rest.size() >= 3 && skipped_ == 0))
      ++broken_;
    ++at;
    bytes_.decided(1);
    is_boundary_ = false;
    if (++skipped_ == kReportSkippedBytes) report_skipped(sink);
  }
  return at;
}

void MessageFramer::report_skipped(Sink& sink) {
  if (skipped_ == 0) return;
  sink.on_skipped(skipped_, broken_, bytes_.received_of_last());
  skipped_ = broken_ = 0;
}

}  // namespace hueline::drivers
