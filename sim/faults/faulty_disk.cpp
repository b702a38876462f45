#include "sim/faults/faulty_disk.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <utility>

namespace hueline::sim {
namespace {

constexpr double kBytesPerMegabyte = 1e6;
constexpr std::uint64_t kPage = 4096, kSector = 512;
// Probabilities for pages that were not synced.
constexpr double kPageSurvives = 0.6, kPageIsTorn = 0.2;

}  // namespace

FaultyDisk::FaultyDisk(const std::vector<FaultLine>& lines, std::uint64_t seed) : lines_(lines), seed_(seed) {
  for (const FaultLine& line : lines_) {
    if ((line.type != FaultType::ProcessKill && line.type != FaultType::PowerCut) || line.begin_ns() >= death_ns_)
      continue;
    death_ = line.type == FaultType::PowerCut ? Death::PowerCut : Death::ProcessKill;
    death_ns_ = line.begin_ns();
  }
}

bool FaultyDisk::concerns(FaultType type) {
  switch (type) {
    case FaultType::DiskSlow:
    case FaultType::DiskFull:
    case FaultType::DiskReadOnly:
    case FaultType::ProcessKill:
    case FaultType::PowerCut:
      return true;
    default:
      return false;
  }
}

const FaultLine* FaultyDisk::line_at(FaultType type) const {
  for (const FaultLine& line : lines_)
    if (line.type == type && now_ns_ >= line.begin_ns() && (type == FaultType::DiskReadOnly || line.covers(now_ns_)))
      return &line;
  return nullptr;
}

/// Returns when `bytes` are on the medium if their writing begins at `from_ns`. Only lines that slow the disk cost
/// time.
std::int64_t FaultyDisk::written_by(std::int64_t from_ns, double bytes) const {
  std::int64_t at = from_ns;
  while (true) {
    const FaultLine* slowest = nullptr;
    for (const FaultLine& line : lines_)
      if (line.type == FaultType::DiskSlow && line.covers(at) && (!slowest || line.strength < slowest->strength))
        slowest = &line;
    if (!slowest) return at;
    // The speed holds until the line ends or another line begins.
    std::int64_t until = slowest->end_ns();
    for (const FaultLine& line : lines_)
      if (line.type == FaultType::DiskSlow && line.begin_ns() > at) until = std::min(until, line.begin_ns());
    const double bytes_per_ns = slowest->strength * kBytesPerMegabyte * 1e-9;
    const double room = bytes_per_ns * static_cast<double>(until - at);
    if (room > bytes) return at + std::llround(std::ceil(bytes / bytes_per_ns));
    bytes -= room;
    at = until;
  }
}

std::int64_t FaultyDisk::append(std::uint64_t bytes) {
  if (is_dead()) return -EIO;
  if (line_at(FaultType::DiskReadOnly)) return -EROFS;
  if (const FaultLine* full = line_at(FaultType::DiskFull)) {
    if (!full_size_) full_size_ = size_ + static_cast<std::uint64_t>(std::llround(full->strength * kBytesPerMegabyte));
    bytes = std::min(bytes, *full_size_ - std::min(*full_size_, size_));
    if (bytes == 0) return -ENOSPC;
  } else {
    full_size_.reset();
  }
  size_ += bytes;
  medium_idle_ns_ = written_by(std::max(now_ns_, medium_idle_ns_), static_cast<double>(bytes));
  return static_cast<std::int64_t>(bytes);
}

int FaultyDisk::sync() {
  if (is_dead()) return -EIO;
  if (line_at(FaultType::DiskReadOnly)) return std::exchange(lost_what_waited_, true) ? -EROFS : -EIO;
  const std::int64_t done = std::max(now_ns_, medium_idle_ns_);
  if (done >= death_ns_) {
    now_ns_ = death_ns_;
    return -EIO;
  }
  now_ns_ = done;
  synced_ = size_;
  return 0;
}

int FaultyDisk::truncate(std::uint64_t size) {
  if (is_dead()) return -EIO;
  if (line_at(FaultType::DiskReadOnly)) return -EROFS;
  size_ = std::min(size_, size);
  synced_ = std::min(synced_, size_);
  return 0;
}

FaultyDisk::Remains FaultyDisk::remains() const {
  Remains out{size_, {}};
  const bool is_certain = death_ == Death::ProcessKill || death_ == Death::None || !is_dead();
  if (is_certain && !line_at(FaultType::DiskReadOnly)) return out;
  SeededRandom random(seed_, kStreamDisk);
  out.size = synced_;
  for (std::uint64_t page = synced_ / kPage * kPage; page < size_; page += kPage) {
    const std::uint64_t begin = std::max(page, synced_), end = std::min(page + kPage, size_);
    const bool survives = random.uniform() < kPageSurvives, is_torn = random.uniform() < kPageIsTorn;
    const std::uint64_t torn_at = page + kSector * static_cast<std::uint64_t>(random.between(1, kPage / kSector - 1));
    const std::uint64_t kept = !survives ? begin : is_torn ? std::clamp(torn_at, begin, end) : end;
    if (kept > begin) out.size = end;  // the length of the file is known to reach the end of what was written
    if (kept < end) out.zeros.push_back({kept, end});
  }
  while (!out.zeros.empty() && out.zeros.back().begin >= out.size) out.zeros.pop_back();
  return out;
}

}  // namespace hueline::sim
