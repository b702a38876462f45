#include "sync/exposure_merger.hpp"

#include <algorithm>
#include <utility>

namespace hueline::sync {

void ExposureMerger::add(std::size_t camera, std::vector<Exposure>& exposures) {
  for (Exposure& exposure : exposures) waiting_[camera].push_back(std::move(exposure));
  exposures.clear();
}

void ExposureMerger::merge(const std::vector<ExposureMatcher>& cameras, std::optional<GpsTime> stream_time,
                           std::vector<Exposure>& out, FaultLog& faults) {
  while (true) {
    std::size_t first = waiting_.size();
    for (std::size_t i = 0; i < waiting_.size(); ++i)
      if (!waiting_[i].empty() &&
          (first == waiting_.size() || waiting_[i].front().exposure_mid < waiting_[first].front().exposure_mid))
        first = i;
    if (first == waiting_.size()) return;
    Exposure& next = waiting_[first].front();
    if (stream_time)
      for (std::size_t i = 0; i < cameras.size(); ++i)
        if (i != first && waiting_[i].empty() && cameras[i].watermark(*stream_time) <= next.exposure_mid) return;
    if (last_ && next.exposure_mid < *last_) {
      faults.add(next.camera, FaultKind::Late, "exposure", next.image.received,
                 "image came after later exposures of other cameras were given out: not used");
    } else {
      last_ = next.exposure_mid;
      next.index = next_++;
      out.push_back(std::move(next));
    }
    waiting_[first].pop_front();
  }
}

GpsTime ExposureMerger::earliest(GpsTime time) const {
  for (const auto& exposures : waiting_)
    if (!exposures.empty()) time = std::min(time, exposures.front().exposure_mid);
  return time;
}

}  // namespace hueline::sync
