// Recordings of ROS 1 with a wrong length in them, which leads to a place where no record begins.
#include <gtest/gtest.h>

#include <span>
#include <string>
#include <vector>

#include "rosbag/bag.hpp"
#include "tests/rosbag/sample_bag.hpp"
#include "tests/support/pcap_writer.hpp"

namespace hueline {
namespace {

/// A chunk of `messages` messages of topic 0, with or without the record that describes the topic.
std::string chunk_record(int messages, bool has_topic) {
  const std::string number = test::raw_of(std::uint32_t{0});
  const std::string about = test::ros1_fields({{"type", "std_msgs/String"}, {"md5sum", "*"}});
  std::string data;
  if (has_topic) data += test::ros1_record({{"op", "\x07"}, {"conn", number}, {"topic", "/text"}}, about);
  for (int i = 0; i < messages; ++i)
    data += test::ros1_record({{"op", "\x02"}, {"conn", number}, {"time", test::raw_of(std::uint64_t{1'700'000'000})}},
                              std::string(40, '\xFF'));  // no record could begin in it
  const auto size = test::raw_of(static_cast<std::uint32_t>(data.size()));
  return test::ros1_record({{"op", "\x05"}, {"compression", "none"}, {"size", size}}, data);
}

/// Three chunks with 3, 2 and 4 messages; the topic is described in the first one and in the index.
struct ThreeChunks {
  std::string bytes;
  std::vector<std::size_t> at;  ///< of the chunks
  std::size_t first_index = 0;  ///< the length of the data of the index record behind the first chunk

  explicit ThreeChunks(bool has_index) {
    const std::string number = test::raw_of(std::uint32_t{0}), one = test::raw_of(std::uint32_t{1});
    std::string body, infos;
    const auto header = [](std::uint64_t index) {
      return "#ROSBAG V2.0\n" + test::ros1_record({{"op", "\x03"}, {"index_pos", test::raw_of(index)}}, "  ");
    };
    const std::vector<std::uint32_t> counts{3, 2, 4};
    for (const std::uint32_t count : counts) {
      at.push_back(header(0).size() + body.size());
      body += chunk_record(static_cast<int>(count), at.size() == 1);
      body += test::ros1_record({{"op", "\x04"}, {"ver", one}, {"conn", number}}, std::string(12 * count, 'i'));
      if (at.size() == 1) first_index = header(0).size() + body.size() - 12 * count - 4;
      infos += test::ros1_record({{"op", "\x06"}, {"chunk_pos", test::raw_of(std::uint64_t{at.back()})}},
                                 number + test::raw_of(count));
    }
    const std::string about = test::ros1_fields({{"type", "std_msgs/String"}, {"md5sum", "*"}});
    infos = test::ros1_record({{"op", "\x07"}, {"conn", number}, {"topic", "/text"}}, about) + infos;
    bytes = header(has_index ? header(0).size() + body.size() : 0) + body + infos;
  }
  void set_length(std::size_t place, std::uint32_t length) { bytes.replace(place, 4, test::raw_of(length)); }
};

struct WasRead {
  int messages = 0;
  std::vector<std::string> damages;
  Error end;
};
WasRead read_whole(const std::string& bytes) {
  const test::TemporaryFile file("damaged.bag", std::as_bytes(std::span(bytes)));
  auto bag = rosbag::open_bag(file.path());
  WasRead out{0, {}, {ErrorCode::Io, ""}};
  while (bag.ok()) {
    const auto message = (*bag)->next();
    if (message.ok()) {
      ++out.messages;
    } else if (message.error().code == ErrorCode::Malformed) {
      out.damages.push_back(message.error().message);
    } else {
      out.end = message.error();
      break;
    }
  }
  return out;
}

TEST(Ros1Damage, TheIndexLeadsOnBehindAWrongLength) {
  ThreeChunks file(true);
  EXPECT_EQ(read_whole(file.bytes).messages, 9);
  file.set_length(file.first_index, 12 * 3 + 150);  // into the second chunk
  const WasRead read = read_whole(file.bytes);
  EXPECT_EQ(read.messages, 9);
  EXPECT_EQ(read.end.code, ErrorCode::EndOfData);
  ASSERT_EQ(read.damages.size(), 1u);
  EXPECT_NE(read.damages[0].find("reading goes on with the chunk at byte " + std::to_string(file.at[1])),
            std::string::npos)
      << read.damages[0];
}

TEST(Ros1Damage, BehindTheLastChunkNothingIsMissing) {
  ThreeChunks file(true);
  // The index record behind the last chunk leads into the connection's record of the index.
  const std::size_t last = file.bytes.rfind(std::string(12 * 4, 'i')) - 4;
  file.set_length(last, 12 * 4 + 9);
  const WasRead read = read_whole(file.bytes);
  EXPECT_EQ(read.messages, 9);
  EXPECT_EQ(read.end.code, ErrorCode::EndOfData);
  ASSERT_EQ(read.damages.size(), 1u);
  EXPECT_NE(read.damages[0].find("no messages are behind it"), std::string::npos) << read.damages[0];
}

TEST(Ros1Damage, SaysHowManyMessagesALostChunkHad) {
  ThreeChunks file(true);
  // The header's length of the second chunk, and of the first: the topic is then known from the index alone.
  for (const auto& [chunk, missing] : {std::pair<std::size_t, int>{1, 2}, {0, 3}}) {
    ThreeChunks broken = file;
    broken.set_length(broken.at[chunk], 0xFFFFFF);
    const WasRead read = read_whole(broken.bytes);
    EXPECT_EQ(read.messages, 9 - missing);
    EXPECT_EQ(read.end.code, ErrorCode::EndOfData);
    ASSERT_EQ(read.damages.size(), 1u);
    EXPECT_NE(read.damages[0].find(std::to_string(missing) + " messages are missing"), std::string::npos)
        << read.damages[0];
  }
}

/// The first recorder of this version stated 20 bytes for each message of an index, and wrote 12.
TEST(Ros1Damage, KnowsTheLengthOfAnIndexThatItsRecorderStatedWrongly) {
  const std::string number = test::raw_of(std::uint32_t{0}), one = test::raw_of(std::uint32_t{1});
  std::string index =
      test::ros1_record({{"op", "\x04"}, {"ver", one}, {"conn", number}, {"count", test::raw_of(std::uint32_t{3})}},
                        std::string(36, 'i'));
  index.replace(index.size() - 36 - 4, 4, test::raw_of(std::uint32_t{60}));
  const WasRead read = read_whole("#ROSBAG V2.0\n" + test::ros1_record({{"op", "\x03"}}, "  ") + chunk_record(3, true) +
                                  index + chunk_record(4, false));
  EXPECT_EQ(read.messages, 7);
  EXPECT_TRUE(read.damages.empty()) << read.damages.front();
  EXPECT_EQ(read.end.code, ErrorCode::EndOfData);
}

TEST(Ros1Damage, NothingBehindTheFirstLineIsNoEmptyRecording) {
  const WasRead read = read_whole("#ROSBAG V2.0\n");
  EXPECT_EQ(read.end.code, ErrorCode::Truncated) << read.end.message;
}

/// A recorder that crashed leaves NAME.bag.active: it says nowhere where its index is, and of its last chunk not how
/// large it is.
TEST(Ros1Damage, AnUnfinishedRecordingIsReadAsFarAsItGoes) {
  ThreeChunks file(false);
  const auto last = file.at.back();
  std::string whole = file.bytes.substr(0, last);
  WasRead read = read_whole(whole);
  EXPECT_EQ(read.messages, 5);
  EXPECT_EQ(read.end.code, ErrorCode::Truncated);
  EXPECT_NE(read.end.message.find("was not finished; all that its recorder had written is read"), std::string::npos);

  const auto begun = [](const char* compression) {
    return test::ros1_record({{"op", "\x05"}, {"compression", compression}, {"size", test::raw_of(std::uint32_t{0})}},
                             "");
  };
  const std::string chunk = chunk_record(4, false);
  const std::string records = chunk.substr(chunk.find("size=") + 4 + 1 + 4 + 4);
  read = read_whole(whole + begun("none") + records);
  EXPECT_EQ(read.messages, 9);
  EXPECT_TRUE(read.damages.empty());
  EXPECT_EQ(read.end.code, ErrorCode::Truncated) << read.end.message;
  // The disk got only a part of the last message.
  read = read_whole(whole + begun("none") + records.substr(0, records.size() - 1));
  EXPECT_EQ(read.messages, 8);
  EXPECT_EQ(read.end.code, ErrorCode::Truncated) << read.end.message;
  read = read_whole(whole + begun("lz4") + std::string(5000, '\x55'));
  EXPECT_EQ(read.messages, 5);
  EXPECT_TRUE(read.damages.empty());
  EXPECT_EQ(read.end.code, ErrorCode::Truncated);
  EXPECT_NE(read.end.message.find("of a chunk that was to be lz4, are not read"), std::string::npos)
      << read.end.message;
}

TEST(Ros1Damage, WithoutAnIndexTheRestIsNotRead) {
  ThreeChunks file(false);
  file.set_length(file.first_index, 12 * 3 + 150);
  const WasRead read = read_whole(file.bytes);
  EXPECT_EQ(read.messages, 3);
  EXPECT_EQ(read.end.code, ErrorCode::Truncated);
  EXPECT_NE(read.end.message.find("the rest is not read"), std::string::npos) << read.end.message;
}

}  // namespace
}  // namespace hueline
