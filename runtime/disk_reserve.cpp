#include "runtime/disk_reserve.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <set>

namespace hueline::runtime {

void DiskReserve::note(std::uint64_t recorded_bytes, double seconds) {
  const double rate = static_cast<double>(recorded_bytes) / std::max(seconds, 60.0);
  bytes_.store(kLeastBytes + static_cast<std::uint64_t>(rate * kSeconds), std::memory_order_relaxed);
}

std::uint64_t DiskReserve::free_bytes() const {
  std::uint64_t sum = 0;
  std::set<dev_t> disks;
  const auto add = [&](const std::filesystem::path& path) {
    struct stat found {};
    if (stat(path.c_str(), &found) == 0 && disks.insert(found.st_dev).second)
      sum += static_cast<std::uint64_t>(std::max<std::int64_t>(0, disk_.free_bytes(path)));
  };
  add(recording_);
  for (const std::string& volume : volumes_) add(volume);
  return sum;
}

Status DiskReserve::check(const std::filesystem::path& product) const {
  struct stat one {
  }, other{};
  if (stat(recording_.c_str(), &one) != 0 || stat(product.c_str(), &other) != 0 || one.st_dev != other.st_dev)
    return {};
  const std::int64_t free = disk_.free_bytes(recording_);
  if (free >= static_cast<std::int64_t>(bytes())) return {};
  return Error{ErrorCode::Exhausted,
               fmt::format("the disk has {} MB left, and the next minutes of the recording need {} MB of them",
                           free / 1'000'000, bytes() / 1'000'000)};
}

}  // namespace hueline::runtime
