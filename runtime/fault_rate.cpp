#include "runtime/fault_rate.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace hueline::runtime {
namespace {

constexpr std::size_t kLongestWords = 96;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/// Returns the detail with each word that holds a digit replaced by one '#'.
std::string words_of(std::string_view detail) {
  std::string words;
  while (!detail.empty() && words.size() < kLongestWords) {
    const auto end = static_cast<std::size_t>(std::find_if(detail.begin(), detail.end(), is_space) - detail.begin());
    const std::string_view piece = detail.substr(0, std::min(end, kLongestWords));
    words += std::any_of(piece.begin(), piece.end(), is_digit) ? std::string_view("#") : piece;
    words += ' ';
    detail.remove_prefix(std::min(end + 1, detail.size()));
  }
  return words;
}

}  // namespace

FaultRate::Entry& FaultRate::entry_of(const Fault& fault, HostTime now) {
  Key key{fault.sensor, fault.kind, words_of(fault.detail)};
  if (const auto known = entries_.find(key); known != entries_.end()) return known->second;
  std::size_t others = 0;
  const auto first = entries_.lower_bound({fault.sensor, fault.kind, {}});
  for (auto it = first; it != entries_.end() && it->first.sensor == fault.sensor && it->first.kind == fault.kind;) {
    const Entry& entry = it->second;
    const bool is_over = entry.held.count == 0 && (!entry.told_at || now - *entry.told_at >= interval_);
    if (!is_over) ++others;
    it = is_over ? entries_.erase(it) : std::next(it);
  }
  if (others >= kTroubles) key.words.clear();
  return entries_[std::move(key)];
}

void FaultRate::add(Fault fault, HostTime now) {
  advance(now);
  Entry& entry = entry_of(fault, now);
  const std::uint64_t count = entry.held.count + fault.count;
  entry.held = std::move(fault);
  entry.held.count = count;
  const HostTime due = entry.told_at ? *entry.told_at + interval_ : now;
  if (due <= now) return tell(entry, now);
  due_ = due_ ? std::min(*due_, due) : due;
}

void FaultRate::advance(HostTime now) {
  if (!due_ || now < *due_) return;
  due_.reset();
  for (auto& [key, entry] : entries_) {
    if (entry.held.count == 0) continue;
    const HostTime due = entry.told_at ? *entry.told_at + interval_ : now;
    if (due <= now)
      tell(entry, now);
    else
      due_ = due_ ? std::min(*due_, due) : due;
  }
}

void FaultRate::flush() {
  for (auto& [key, entry] : entries_)
    if (entry.held.count > 0) tell(entry, entry.told_at.value_or(entry.held.time));
  due_.reset();
}

void FaultRate::take_back(Fault fault) {
  Entry& entry = entry_of(fault, fault.time);
  fault.count += entry.held.count;
  entry.held = std::move(fault);
  const HostTime due = entry.told_at.value_or(entry.held.time);
  due_ = due_ ? std::min(*due_, due) : due;
}

std::vector<Fault> FaultRate::take() { return std::exchange(ready_, {}); }

void FaultRate::tell(Entry& entry, HostTime now) {
  ready_.push_back(std::move(entry.held));
  entry.held.count = 0;
  entry.told_at = now;
}

}  // namespace hueline::runtime
