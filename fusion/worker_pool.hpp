#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <thread>
#include <vector>

#include "core/mutex.hpp"

namespace hueline::fusion {

/// Distributes independent pieces of work over threads. A result must depend only on the number of its piece, because
/// any thread may compute it. Thread safety: none; one thread makes all calls.
class WorkerPool {
 public:
  /// `threads` includes the caller: 1 starts no thread.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Calls work(i) once for each i in [0, count) and returns when all calls have ended. `work` must not throw.
  void run(std::size_t count, const std::function<void(std::size_t)>& work);

 private:
  void serve(std::stop_token stop);
  void take_pieces() HUELINE_REQUIRES(mutex_);

  Mutex mutex_;
  std::condition_variable_any wake_;
  std::condition_variable_any done_;
  const std::function<void(std::size_t)>* work_ HUELINE_GUARDED_BY(mutex_) = nullptr;
  std::size_t next_ HUELINE_GUARDED_BY(mutex_) = 0, count_ HUELINE_GUARDED_BY(mutex_) = 0,
                    unfinished_ HUELINE_GUARDED_BY(mutex_) = 0;
  std::vector<std::jthread> threads_;  // declared last, so that the threads end before the members that they use
};

}  // namespace hueline::fusion
