#include "object_store/block_reader.hpp"

#include <algorithm>
#include <utility>

namespace hueline::object_store {

BlockReader::BlockReader(std::uint64_t size, Fetch fetch, Config config, std::span<const std::byte> head)
    : size_(size),
      blocks_((size + config.block_bytes - 1) / config.block_bytes),
      fetch_(std::move(fetch)),
      config_(config) {
  const Lock lock(mutex_);
  const auto first = static_cast<std::size_t>(std::min<std::uint64_t>(size, config.block_bytes));
  if (first == 0 || head.size() < first) return;
  Block& block = kept_[0];
  block.is_loading = false;
  block.bytes.assign(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(first));
}

BlockReader::~BlockReader() {
  std::vector<std::jthread> threads;
  {
    const Lock lock(mutex_);
    threads.swap(threads_);
    wanted_.clear();
  }
  for (std::jthread& thread : threads) thread.request_stop();
  changed_.notify_all();
}

Status BlockReader::read(std::uint64_t offset, std::span<std::byte> out) {
  Lock lock(mutex_);
  look_ahead(offset, offset + out.size());
  const std::uint64_t end = (offset + out.size() + config_.block_bytes - 1) / config_.block_bytes;
  while (!out.empty()) {
    const std::uint64_t number = offset / config_.block_bytes;
    const auto found = kept_.find(number);
    if (found == kept_.end()) {
      const Run run = missing_run(number, end, config_.most_blocks_at_once);
      lock.unlock();
      load(run, {});
      lock.lock();
      continue;
    }
    Block& block = found->second;
    if (block.is_loading) {
      changed_.wait(lock);
      continue;
    }
    if (block.error) {
      Error error = *block.error;
      kept_.erase(found);
      return error;
    }
    block.used = ++uses_;
    const std::uint64_t inside = offset - number * config_.block_bytes;
    const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(out.size(), block.bytes.size() - inside));
    std::copy_n(block.bytes.begin() + static_cast<std::ptrdiff_t>(inside), part, out.begin());
    out = out.subspan(part);
    offset += part;
  }
  return {};
}

/// Takes the blocks from `first` on, up to `end` and at most so many, that nobody has or fetches, and marks them as
/// being fetched.
BlockReader::Run BlockReader::missing_run(std::uint64_t first, std::uint64_t end, std::uint64_t most) {
  Run run{first, 0};
  for (std::uint64_t i = first; i < std::min(end, first + most) && !kept_.contains(i); ++i) {
    kept_.emplace(i, Block());
    ++run.count;
  }
  return run;
}

/// Asks for what comes behind, if the caller reads on.
void BlockReader::look_ahead(std::uint64_t offset, std::uint64_t end) {
  const bool reads_on = offset >= end_ && offset - end_ <= config_.block_bytes;
  on_end_ = reads_on ? on_end_ + (end - offset) : 0;
  end_ = end;
  const std::uint64_t read_on = on_end_ / config_.block_bytes;
  const auto ahead = std::min<std::uint64_t>(read_on - std::min<std::uint64_t>(read_on, config_.blocks_before_ahead),
                                             config_.most_blocks_ahead);
  if (ahead == 0) return;
  std::uint64_t next = (end + config_.block_bytes - 1) / config_.block_bytes;
  const std::uint64_t last = std::min(blocks_, next + ahead);
  const std::uint64_t at_once =
      std::clamp<std::uint64_t>(ahead / std::max<std::size_t>(1, config_.threads), 1, config_.most_blocks_at_once);
  for (;;) {
    while (next < last && kept_.contains(next)) ++next;
    // Small pieces would cost a request each: what is missing at the end waits until it is a whole one.
    if (next >= last || (last - next < at_once && last < blocks_)) break;
    const Run run = missing_run(next, last, at_once);
    wanted_.push_back(run);
    next += run.count;
  }
  while (!wanted_.empty() && threads_.size() < config_.threads)
    threads_.emplace_back([this](const std::stop_token& stop) { work(stop); });
  changed_.notify_all();
}

void BlockReader::work(const std::stop_token& stop) {
  Lock lock(mutex_);
  while (changed_.wait(lock, stop, [this]() HUELINE_REQUIRES(mutex_) { return !wanted_.empty(); })) {
    const Run run = wanted_.front();
    wanted_.pop_front();
    lock.unlock();
    load(run, stop);
    lock.lock();
  }
}

void BlockReader::load(Run run, const std::stop_token& stop) {
  const std::uint64_t begin = run.first * config_.block_bytes;
  const std::uint64_t end = std::min(size_, (run.first + run.count) * config_.block_bytes);
  std::vector<std::byte> bytes(static_cast<std::size_t>(end - begin));
  const Status fetched = fetch_(begin, bytes, stop);
  const Lock lock(mutex_);
  for (std::uint64_t i = 0; i < run.count; ++i) {
    Block& block = kept_[run.first + i];
    block.is_loading = false;
    block.used = ++uses_;
    if (!fetched.ok()) {
      block.error = fetched.error();
      continue;
    }
    const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(i * config_.block_bytes);
    const auto size = std::min<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(config_.block_bytes), bytes.end() - from);
    block.bytes.assign(from, from + size);
  }
  forget_oldest();
  changed_.notify_all();
}

void BlockReader::forget_oldest() {
  const auto is_whole = [](const auto& one) { return !one.second.is_loading; };
  while (std::ranges::count_if(kept_, is_whole) > static_cast<std::ptrdiff_t>(config_.most_blocks_kept)) {
    auto oldest = kept_.end();
    for (auto one = kept_.begin(); one != kept_.end(); ++one)
      if (is_whole(*one) && (oldest == kept_.end() || one->second.used < oldest->second.used)) oldest = one;
    kept_.erase(oldest);
  }
}

}  // namespace hueline::object_store
