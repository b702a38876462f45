#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace hueline::fusion {

/// Splits independent pieces of work over threads. What is computed must depend on the piece's number alone; who
/// computes it is left to chance. Thread-bound: one caller.
class WorkerPool {
 public:
  /// `threads` counts the caller: 1 starts none.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Calls work(i) once for each i in [0, count) and returns when all are done. `work` must not throw.
  void run(std::size_t count, const std::function<void(std::size_t)>& work);

 private:
  void serve(std::stop_token stop);
  void take_pieces(std::unique_lock<std::mutex>& lock);

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::condition_variable_any done_;
  const std::function<void(std::size_t)>* work_ = nullptr;
  std::size_t next_ = 0, count_ = 0, unfinished_ = 0;
  std::vector<std::jthread> threads_;  // last: they end before what they use
};

}  // namespace hueline::fusion
