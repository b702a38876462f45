#include "core/bounded_queue.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace hueline {
namespace {

using namespace std::chrono_literals;

TEST(BoundedQueue, BoundsNumberAndWeight) {
  BoundedQueue<int> queue({3, 100});
  EXPECT_TRUE(queue.try_push(1, 60));
  EXPECT_FALSE(queue.try_push(2, 60)) << "too heavy beside the first";
  EXPECT_TRUE(queue.try_push(2, 40));
  EXPECT_FALSE(queue.try_push(3, 1));
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_TRUE(queue.try_push(3, 1));
  EXPECT_TRUE(queue.try_push(4, 1));
  EXPECT_FALSE(queue.try_push(5, 1)) << "three items are the limit";
  EXPECT_EQ(queue.weight(), 42u);
}

TEST(BoundedQueue, TakesAnItemHeavierThanTheLimitWhenEmpty) {
  BoundedQueue<int> queue({3, 100});
  EXPECT_TRUE(queue.try_push(1, 1000));
}

TEST(BoundedQueue, CloseDrainsThenEnds) {
  BoundedQueue<int> queue({4});
  queue.try_push(7);
  queue.close();
  EXPECT_FALSE(queue.try_push(8));
  EXPECT_EQ(queue.pop(), 7);
  EXPECT_EQ(queue.pop(), std::nullopt);
}

TEST(BoundedQueue, StopAndCloseFreeEveryWaiter) {
  for (const bool by_stop : {true, false}) {
    BoundedQueue<int> full({1}), empty({1});
    full.try_push(1);
    std::stop_source stop;
    std::jthread producer([&] { EXPECT_FALSE(full.push(2, stop.get_token())); });
    std::jthread consumer([&] { EXPECT_EQ(empty.pop(stop.get_token()), std::nullopt); });
    std::this_thread::sleep_for(10ms);
    if (by_stop) {
      stop.request_stop();
    } else {
      full.close();
      empty.close();
    }
  }
}

TEST(BoundedQueue, ManyProducersLoseNothing) {
  BoundedQueue<int> queue({8});
  long sum = 0;
  {
    std::jthread consumer([&] {
      while (auto item = queue.pop()) sum += *item;
    });
    {
      std::vector<std::jthread> producers;
      for (int p = 0; p < 3; ++p)
        producers.emplace_back([&] {
          for (int i = 1; i <= 1000; ++i) ASSERT_TRUE(queue.push(i, {}));
        });
    }
    queue.close();
  }
  EXPECT_EQ(sum, 3L * 500500);
}

TEST(BoundedQueue, AProducerThatCanWaitWaitsForAShareToBeFree) {
  BoundedQueue<int> queue({10, 100});
  std::stop_source stop;
  for (int i = 0; i < 6; ++i) ASSERT_TRUE(queue.try_push(i, 10));
  std::atomic<bool> is_free{false};
  std::jthread waiting([&] { is_free = queue.wait_until_below(0.5, stop.get_token()); });
  EXPECT_FALSE(is_free);
  queue.pop();
  waiting.join();
  EXPECT_TRUE(is_free);
  ASSERT_TRUE(queue.try_push(6, 1));
  stop.request_stop();
  EXPECT_FALSE(queue.wait_until_below(0.5, stop.get_token()));
}

TEST(BoundedQueue, AConsumerWaitsNoLongerThanItSays) {
  BoundedQueue<int> queue({4});
  EXPECT_EQ(queue.pop_within(std::chrono::milliseconds(1)), std::nullopt);
  EXPECT_FALSE(queue.is_drained()) << "something may still come";
  EXPECT_TRUE(queue.try_push(7));
  queue.close();
  EXPECT_FALSE(queue.is_drained());
  EXPECT_EQ(queue.pop_within(std::chrono::hours(1)), 7);
  EXPECT_TRUE(queue.is_drained());
  EXPECT_EQ(queue.pop_within(std::chrono::hours(1)), std::nullopt) << "nothing will come: no wait";
}

}  // namespace
}  // namespace hueline
