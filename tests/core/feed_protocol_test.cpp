#include "core/feed_protocol.hpp"

#include <gtest/gtest.h>

#include <random>

namespace hueline::feed {
namespace {

TEST(FeedProtocol, CutsAStreamIntoItsFramesHoweverItComes) {
  std::mt19937 random(1);
  std::string stream;
  std::vector<std::string> sent;
  for (int i = 0; i < 200; ++i) {
    sent.emplace_back(random() % 300, static_cast<char>('a' + i % 26));
    stream += i % 2 ? frame(Kind::Hello, sent.back()) : message_frame(7, -5, sent.back());
  }
  FrameReader reader(1000);
  std::size_t got = 0;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t size = std::min<std::size_t>(1 + random() % 500, stream.size() - at);
    reader.add(std::string_view(stream).substr(at, size));
    at += size;
    for (;;) {
      auto next = reader.next();
      ASSERT_TRUE(next.ok());
      if (!*next) break;
      if (got % 2) {
        EXPECT_EQ((*next)->kind, Kind::Hello);
        EXPECT_EQ((*next)->content, sent[got]);
      } else {
        const auto message = read_message((*next)->content);
        ASSERT_TRUE(message);
        EXPECT_EQ(message->channel, 7u);
        EXPECT_EQ(message->unix_ns, -5);
        EXPECT_EQ(message->bytes, sent[got]);
      }
      ++got;
    }
  }
  EXPECT_EQ(got, sent.size());
}

TEST(FeedProtocol, RefusesAFrameThatClaimsTooMuch) {
  FrameReader reader(100);
  reader.add(std::string("\x65\x00\x00\x00\x03", 5));  // 101 bytes
  EXPECT_EQ(reader.next().error().code, ErrorCode::Malformed);
}

}  // namespace
}  // namespace hueline::feed
