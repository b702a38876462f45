#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <optional>
#include <stop_token>
#include <utility>

#include "core/mutex.hpp"

namespace hueline {

/// A queue that is bounded in the number and in the total weight (bytes) of its items. Thread-safe, for many producers
/// and many consumers. Every wait ends when a stop is requested or the queue is closed.
template <class T>
class BoundedQueue {
 public:
  struct Limits {
    std::size_t items;
    std::size_t weight = static_cast<std::size_t>(-1);
  };
  explicit BoundedQueue(Limits limits) : limits_(limits) {}

  /// Adds an item without waiting. Returns false if the queue is full or closed. An empty queue accepts an item that is
  /// heavier than the limit.
  bool try_push(T item, std::size_t weight = 1) {
    {
      Lock lock(mutex_);
      if (closed_ || !has_room(weight)) return false;
      put(std::move(item), weight);
    }
    filled_.notify_one();
    return true;
  }

  /// Adds an item, and waits for room if necessary. Returns false if the queue was closed or a stop was requested; the
  /// item is then not added.
  bool push(T item, std::stop_token stop, std::size_t weight = 1) {
    {
      Lock lock(mutex_);
      if (!emptied_.wait(lock, stop, [&]() HUELINE_REQUIRES(mutex_) { return closed_ || has_room(weight); }) || closed_)
        return false;
      put(std::move(item), weight);
    }
    filled_.notify_one();
    return true;
  }

  /// Returns the next item, and waits for it if necessary. Returns nothing if a stop was requested, or if the queue is
  /// closed and empty.
  std::optional<T> pop(std::stop_token stop = {}) {
    std::optional<T> item;
    {
      Lock lock(mutex_);
      filled_.wait(lock, stop, [&]() HUELINE_REQUIRES(mutex_) { return closed_ || !items_.empty(); });
      item = take();
    }
    if (item) emptied_.notify_all();
    return item;
  }
  /// Returns the next item, and waits for it for at most `time`. Returns nothing if none came, or if the queue is
  /// closed and empty.
  template <class Rep, class Period>
  std::optional<T> pop_within(std::chrono::duration<Rep, Period> time) {
    std::optional<T> item;
    {
      Lock lock(mutex_);
      filled_.wait_for(lock, time, [&]() HUELINE_REQUIRES(mutex_) { return closed_ || !items_.empty(); });
      item = take();
    }
    if (item) emptied_.notify_all();
    return item;
  }
  /// Returns true if the queue is closed and empty.
  bool is_drained() const {
    Lock lock(mutex_);
    return closed_ && items_.empty();
  }

  /// Waits until at most `share` of each limit is in use. A producer that can wait calls this, so that room is left for
  /// those that cannot. Returns false if the queue was closed or a stop was requested.
  bool wait_until_below(double share, std::stop_token stop) {
    const auto part = [&](std::size_t limit) { return static_cast<std::size_t>(share * static_cast<double>(limit)); };
    const Limits most{part(limits_.items),
                      limits_.weight == static_cast<std::size_t>(-1) ? limits_.weight : part(limits_.weight)};
    Lock lock(mutex_);
    return emptied_.wait(lock, stop, [&]() HUELINE_REQUIRES(mutex_) {
      return closed_ || items_.empty() || (items_.size() <= most.items && weight_ <= most.weight);
    }) && !closed_;
  }

  /// Closes the queue: no more items are accepted, but the items inside can still be popped.
  void close() {
    {
      Lock lock(mutex_);
      closed_ = true;
    }
    filled_.notify_all();
    emptied_.notify_all();
  }

  /// Returns true if try_push() of this weight would succeed. The answer stays valid only while no other producer
  /// pushes, for example under a lock of the caller.
  bool has_room_for(std::size_t weight) const {
    Lock lock(mutex_);
    return !closed_ && has_room(weight);
  }
  std::size_t size() const {
    Lock lock(mutex_);
    return items_.size();
  }
  std::size_t weight() const {
    Lock lock(mutex_);
    return weight_;
  }

 private:
  bool has_room(std::size_t weight) const HUELINE_REQUIRES(mutex_) {
    return items_.empty() || (items_.size() < limits_.items && weight_ + weight <= limits_.weight);
  }
  std::optional<T> take() HUELINE_REQUIRES(mutex_) {
    std::optional<T> item;
    if (items_.empty()) return item;
    item.emplace(std::move(items_.front().first));
    weight_ -= items_.front().second;
    items_.pop_front();
    return item;
  }
  void put(T item, std::size_t weight) HUELINE_REQUIRES(mutex_) {
    items_.emplace_back(std::move(item), weight);
    weight_ += weight;
  }

  const Limits limits_;
  mutable Mutex mutex_;
  std::condition_variable_any filled_, emptied_;
  std::deque<std::pair<T, std::size_t>> items_ HUELINE_GUARDED_BY(mutex_);
  std::size_t weight_ HUELINE_GUARDED_BY(mutex_) = 0;
  bool closed_ HUELINE_GUARDED_BY(mutex_) = false;
};

}  // namespace hueline
