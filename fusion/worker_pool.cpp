#include "fusion/worker_pool.hpp"

namespace hueline::fusion {

WorkerPool::WorkerPool(int threads) {
  for (int i = 1; i < threads; ++i) threads_.emplace_back([this](std::stop_token stop) { serve(stop); });
}

WorkerPool::~WorkerPool() {
  for (std::jthread& thread : threads_) thread.request_stop();
}

void WorkerPool::take_pieces() {
  while (work_ != nullptr && next_ < count_) {
    const std::size_t piece = next_++;
    const auto& work = *work_;
    mutex_.unlock();
    work(piece);
    mutex_.lock();
    if (--unfinished_ == 0) done_.notify_all();
  }
}

void WorkerPool::serve(std::stop_token stop) {
  Lock lock(mutex_);
  while (wake_.wait(lock, stop, [this]() HUELINE_REQUIRES(mutex_) { return work_ != nullptr && next_ < count_; }))
    take_pieces();
}

void WorkerPool::run(std::size_t count, const std::function<void(std::size_t)>& work) {
  if (threads_.empty()) {
    for (std::size_t i = 0; i < count; ++i) work(i);
    return;
  }
  Lock lock(mutex_);
  work_ = &work;
  next_ = 0;
  count_ = unfinished_ = count;
  if (count > 1) wake_.notify_all();
  take_pieces();
  done_.wait(lock, [this]() HUELINE_REQUIRES(mutex_) { return unfinished_ == 0; });
  work_ = nullptr;
}

}  // namespace hueline::fusion
