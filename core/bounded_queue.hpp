#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

namespace hueline {

/// Bounded by number and by weight (bytes); thread-safe; many producers, many consumers. Every wait ends on stop or
/// close.
template <class T>
class BoundedQueue {
 public:
  struct Limits {
    std::size_t items;
    std::size_t weight = static_cast<std::size_t>(-1);
  };
  explicit BoundedQueue(Limits limits) : limits_(limits) {}

  /// False if full or closed; never waits. An item heavier than the limit is accepted when the queue is empty.
  bool try_push(T item, std::size_t weight = 1) {
    {
      std::lock_guard lock(mutex_);
      if (closed_ || !has_room(weight)) return false;
      put(std::move(item), weight);
    }
    filled_.notify_one();
    return true;
  }

  /// Waits for room. False if closed or stopped: the item was not taken.
  bool push(T item, std::stop_token stop, std::size_t weight = 1) {
    {
      std::unique_lock lock(mutex_);
      if (!emptied_.wait(lock, stop, [&] { return closed_ || has_room(weight); }) || closed_) return false;
      put(std::move(item), weight);
    }
    filled_.notify_one();
    return true;
  }

  /// Waits for an item. Empty once closed and drained, or when stopped.
  std::optional<T> pop(std::stop_token stop = {}) {
    std::unique_lock lock(mutex_);
    filled_.wait(lock, stop, [&] { return closed_ || !items_.empty(); });
    return take(std::move(lock));
  }
  /// Waits for an item, at most so long. Empty likewise, or when none came.
  template <class Rep, class Period>
  std::optional<T> pop_within(std::chrono::duration<Rep, Period> time) {
    std::unique_lock lock(mutex_);
    filled_.wait_for(lock, time, [&] { return closed_ || !items_.empty(); });
    return take(std::move(lock));
  }
  /// Nothing is inside and nothing will come.
  bool is_drained() const {
    std::lock_guard lock(mutex_);
    return closed_ && items_.empty();
  }

  /// Waits until at most `share` of each limit is taken: for a producer that can wait, beside others that cannot. False
  /// if closed or stopped.
  bool wait_until_below(double share, std::stop_token stop) {
    const auto part = [&](std::size_t limit) { return static_cast<std::size_t>(share * static_cast<double>(limit)); };
    const Limits most{part(limits_.items),
                      limits_.weight == static_cast<std::size_t>(-1) ? limits_.weight : part(limits_.weight)};
    std::unique_lock lock(mutex_);
    return emptied_.wait(lock, stop, [&] {
      return closed_ || items_.empty() || (items_.size() <= most.items && weight_ <= most.weight);
    }) && !closed_;
  }

  /// No more pushes; what is inside can still be popped.
  void close() {
    {
      std::lock_guard lock(mutex_);
      closed_ = true;
    }
    filled_.notify_all();
    emptied_.notify_all();
  }

  /// True if a try_push of this weight would succeed, for a decision made under the caller's own lock (single
  /// producer).
  bool has_room_for(std::size_t weight) const {
    std::lock_guard lock(mutex_);
    return !closed_ && has_room(weight);
  }
  std::size_t size() const {
    std::lock_guard lock(mutex_);
    return items_.size();
  }
  std::size_t weight() const {
    std::lock_guard lock(mutex_);
    return weight_;
  }

 private:
  bool has_room(std::size_t weight) const {
    return items_.empty() || (items_.size() < limits_.items && weight_ + weight <= limits_.weight);
  }
  std::optional<T> take(std::unique_lock<std::mutex> lock) {
    std::optional<T> item;
    if (items_.empty()) return item;
    item.emplace(std::move(items_.front().first));
    weight_ -= items_.front().second;
    items_.pop_front();
    lock.unlock();
    emptied_.notify_all();
    return item;
  }
  void put(T item, std::size_t weight) {
    items_.emplace_back(std::move(item), weight);
    weight_ += weight;
  }

  const Limits limits_;
  mutable std::mutex mutex_;
  std::condition_variable_any filled_, emptied_;
  std::deque<std::pair<T, std::size_t>> items_;
  std::size_t weight_ = 0;
  bool closed_ = false;
};

}  // namespace hueline
