#pragma once

#include <mutex>

/// A mutex and its lock as clang's thread-safety analysis knows them. Members that a mutex guards say so with
/// HUELINE_GUARDED_BY, functions that want it locked say so with HUELINE_REQUIRES, and clang refuses to compile an
/// access without the lock (-Wthread-safety, an error in the builds with sanitizers). Other compilers see nothing of
/// it.
///
///   class Counter {
///    public:
///     void add() {
///       const Lock lock(mutex_);
///       ++count_;
///     }
///
///    private:
///     Mutex mutex_;
///     int count_ HUELINE_GUARDED_BY(mutex_) = 0;
///   };
///
/// Source: https://clang.llvm.org/docs/ThreadSafetyAnalysis.html
#if defined(__clang__)
#define HUELINE_THREAD_ATTRIBUTE(attribute) __attribute__((attribute))
#else
#define HUELINE_THREAD_ATTRIBUTE(attribute)
#endif
#define HUELINE_GUARDED_BY(mutex) HUELINE_THREAD_ATTRIBUTE(guarded_by(mutex))
#define HUELINE_REQUIRES(mutex) HUELINE_THREAD_ATTRIBUTE(requires_capability(mutex))
#define HUELINE_EXCLUDES(mutex) HUELINE_THREAD_ATTRIBUTE(locks_excluded(mutex))

namespace hueline {

/// std::mutex, known to the analysis. Thread-safe.
class HUELINE_THREAD_ATTRIBUTE(capability("mutex")) Mutex {
 public:
  void lock() HUELINE_THREAD_ATTRIBUTE(acquire_capability()) { mutex_.lock(); }
  void unlock() HUELINE_THREAD_ATTRIBUTE(release_capability()) { mutex_.unlock(); }

 private:
  std::mutex mutex_;
};

/// Holds a Mutex while it lives. It can be unlocked and locked again before, as a std::condition_variable_any does
/// while it waits; the predicate of such a wait is a lambda with HUELINE_REQUIRES. One thread uses a lock.
class HUELINE_THREAD_ATTRIBUTE(scoped_lockable) Lock {
 public:
  explicit Lock(Mutex& mutex) HUELINE_THREAD_ATTRIBUTE(acquire_capability(mutex)) : mutex_(mutex) { mutex.lock(); }
  ~Lock() HUELINE_THREAD_ATTRIBUTE(release_capability()) {
    if (is_held_) mutex_.unlock();
  }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

  void lock() HUELINE_THREAD_ATTRIBUTE(acquire_capability()) {
    mutex_.lock();
    is_held_ = true;
  }
  void unlock() HUELINE_THREAD_ATTRIBUTE(release_capability()) {
    is_held_ = false;
    mutex_.unlock();
  }

 private:
  Mutex& mutex_;
  bool is_held_ = true;
};

}  // namespace hueline
