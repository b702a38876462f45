// Vector's binary logs: real ones, made ones with every form of frame, and broken ones.
#include "drivers/can/blf.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <libdeflate.h>
#include <linux/can/error.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/input_file.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

struct Read {
  std::vector<CanLogEntry> entries;
  std::vector<std::string> troubles;
  std::map<std::string, std::uint64_t> passed_over;
};
Read read(const std::filesystem::path& path) {
  Read out;
  auto file = InputFile::open(path);
  if (!file.ok()) return out;
  BlfReader reader(std::move(*file));
  for (int i = 0; i < 100'000; ++i) {
    const auto entry = reader.next();
    if (!entry.ok()) {
      out.troubles.push_back(entry.error().message);
      if (entry.error().code == ErrorCode::Unsupported) break;
    } else if (!*entry) {
      break;
    } else {
      out.entries.push_back(**entry);
    }
  }
  out.passed_over = reader.passed_over();
  return out;
}
std::vector<std::uint32_t> ids(const Read& log) {
  std::vector<std::uint32_t> out;
  for (const CanLogEntry& one : log.entries) out.push_back(one.frame.id);
  return out;
}

template <class T>
std::string little(T value) {
  std::string out;
  for (std::size_t i = 0; i < sizeof(T); ++i) out += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i));
  return out;
}
std::string object(std::uint32_t type, const std::string& body, std::uint64_t stamp, std::uint32_t flags = 2) {
  return "LOBJ" + little<std::uint16_t>(32) + little<std::uint16_t>(1) +
         little(static_cast<std::uint32_t>(32 + body.size())) + little(type) + little(flags) + little(0) +
         little(stamp) + body;
}
std::string message(std::uint32_t id, std::uint64_t stamp, std::uint32_t flags = 2) {
  return object(1, little<std::uint16_t>(3) + '\0' + '\x02' + little(id) + std::string("\xAA\xBB\0\0\0\0\0\0", 8),
                stamp, flags);
}
std::string container(const std::string& content, bool is_packed = true) {
  std::string packed = content;
  if (is_packed) {
    auto* compressor = libdeflate_alloc_compressor(6);
    packed.resize(libdeflate_zlib_compress_bound(compressor, content.size()));
    packed.resize(libdeflate_zlib_compress(compressor, content.data(), content.size(), packed.data(), packed.size()));
    libdeflate_free_compressor(compressor);
  }
  const std::string head = little<std::uint16_t>(is_packed ? 2 : 0) + std::string(6, '\0') +
                           little(static_cast<std::uint32_t>(content.size())) + std::string(4, '\0');
  std::string out = "LOBJ" + little<std::uint16_t>(16) + little<std::uint16_t>(1) +
                    little(static_cast<std::uint32_t>(16 + head.size() + packed.size())) + little(10) + head + packed;
  return out + std::string(packed.size() % 4, '\0');
}
std::string log_of(const std::string& objects) { return "LOGG" + little(144) + std::string(136, '\0') + objects; }

Read read_bytes(const std::string& bytes) {
  const test::TemporaryFolder folder;
  test::write_file(folder / "log.blf", bytes);
  return read(folder / "log.blf");
}

TEST(Blf, ARealLogOfClassicFrames) {
  HUELINE_REQUIRE_DATA("can/test_CanMessage.blf");
  // Its bytes, after unpacking: made values, among them an id of more than 11 bits without the flag for it.
  const Read log = read(data_file);
  EXPECT_THAT(log.troubles, ElementsAre());
  ASSERT_EQ(log.entries.size(), 2u);
  for (const CanLogEntry& one : log.entries) {
    EXPECT_EQ(one.time.count(), 0x2222222222222222);
    EXPECT_EQ(one.frame.id, 0x4444444u);
    EXPECT_EQ(one.frame.bus, 0x11);
    EXPECT_THAT(one.frame.bytes(), ElementsAre(0x55, 0x66, 0x77, 0x88, 0x99, 0xAA, 0xBB, 0xCC));
  }
}

TEST(Blf, ARealLogOfFdFrames) {
  HUELINE_REQUIRE_DATA("can/test_CanFdMessage.blf");
  const Read log = read(data_file);
  EXPECT_THAT(log.troubles, ElementsAre());
  ASSERT_EQ(log.entries.size(), 2u);
  for (const CanLogEntry& one : log.entries) {
    EXPECT_EQ(one.frame.id, 0x4444444u);
    EXPECT_TRUE(one.frame.is_fd);
    ASSERT_EQ(one.frame.length, 64);
    for (int i = 0; i < 64; ++i) EXPECT_EQ(one.frame.data[static_cast<std::size_t>(i)], i);
  }
}

/// Loggers of a vehicle record its other networks into the same file.
TEST(Blf, WhatIsPassedOverIsCountedByItsKind) {
  const std::string body(40, 'x');
  const Read log =
      read_bytes(log_of(object(71, body, 1) +
                        container(object(120, body, 2) + object(11, body, 3) + message(0x123, 4) + object(66, body, 5) +
                                  object(96, body, 6)) +
                        container(object(57, std::string(900, 'x'), 7).substr(0, 500), false) +
                        container(object(57, std::string(900, 'x'), 7).substr(500), false) + object(46, body, 8)));
  EXPECT_THAT(log.troubles, ElementsAre());
  EXPECT_THAT(ids(log), ElementsAre(0x123));
  EXPECT_THAT(log.passed_over, ElementsAre(Pair("Ethernet", 2), Pair("FlexRay", 1), Pair("GPS", 1), Pair("LIN", 2),
                                           Pair("other kinds", 1)));
}

TEST(Blf, EveryFormOfFrame) {
  const std::string fd = little<std::uint16_t>(1) + '\x01' + '\x09' + little(0x80000123U) + little(0) + '\0' + '\x01' +
                         '\x0C' + std::string(5, '\0') + std::string(64, '\x11');
  std::string fd64 = std::string("\x02\x0F\x40\0", 4) + little(0x7FFU) + little(0) + little(0x1000U) +
                     std::string(16, '\0') + std::string(2, '\0') + std::string("\x01\0", 2) + little(0) +
                     std::string(64, '\x22');
  // As a logger writes it that leaves zeros at the end out.
  const std::string bare64 = fd64.substr(0, fd64.size() - 16);
  const std::string remote =
      object(86, little<std::uint16_t>(1) + '\x80' + '\x08' + little(0x55) + std::string(8, '\0'), 5);
  const Read log = read_bytes(
      log_of(container(message(0x123, 7, 1) + object(100, fd, 8) + object(101, fd64, 9) + object(101, bare64, 9) +
                       remote + object(73, std::string("\x04\0", 2) + std::string(30, '\0'), 10) +
                       object(65, std::string(500, 'x'), 11) + message(0x456, 12))));
  EXPECT_THAT(log.troubles, ElementsAre());
  ASSERT_EQ(log.entries.size(), 7u);
  EXPECT_EQ(log.entries[0].time.count(), 70'000) << "units of 10 us";
  EXPECT_EQ(log.entries[0].frame.bus, 3);
  EXPECT_EQ(log.entries[0].frame.length, 2);
  EXPECT_EQ(log.entries[0].frame.data[1], 0xBB);
  EXPECT_TRUE(log.entries[1].frame.is_fd && log.entries[1].frame.is_extended && log.entries[1].frame.is_local);
  EXPECT_EQ(log.entries[1].frame.length, 12);
  EXPECT_EQ(log.entries[2].frame.length, 64);
  EXPECT_TRUE(log.entries[2].frame.is_fd && log.entries[2].frame.is_local && !log.entries[2].frame.is_extended);
  EXPECT_EQ(log.entries[2].frame.data[63], 0x22);
  EXPECT_EQ(log.entries[3].frame.length, 64);
  EXPECT_EQ(log.entries[3].frame.data[47], 0x22);
  EXPECT_EQ(log.entries[3].frame.data[48], 0);
  EXPECT_TRUE(log.entries[4].frame.is_remote);
  EXPECT_TRUE(log.entries[5].frame.is_error);
  EXPECT_EQ(log.entries[5].frame.bus, 4);
  EXPECT_EQ(log.entries[5].frame.id, static_cast<std::uint32_t>(CAN_ERR_PROT | CAN_ERR_BUSERROR));
  EXPECT_EQ(log.entries[6].time.count(), 12);
}

TEST(Blf, ObjectsMayContinueInTheNextContainer) {
  std::string objects;
  std::vector<std::uint32_t> expected;
  for (std::uint32_t i = 0; i < 50; ++i) {
    objects += message(i, i);
    objects += object(65, std::string(i, 'x'), i);  // another kind, with lengths of all remainders
    objects += std::string((32 + i) % 4, '\0');
    expected.push_back(i);
  }
  for (const std::size_t piece : {1u, 7u, 33u, 500u}) {
    std::string log;
    for (std::size_t at = 0; at < objects.size(); at += piece)
      log += container(objects.substr(at, piece), at / piece % 2 == 0);
    const Read read = read_bytes(log_of(log));
    EXPECT_THAT(read.troubles, ElementsAre()) << piece;
    EXPECT_EQ(ids(read), expected) << piece;
  }
}

TEST(Blf, ALogThatIsCutAnywhereGivesWhatIsWhole) {
  const std::string log = log_of(container(message(1, 1) + message(2, 2)) + container(message(3, 3)) + message(4, 4));
  for (std::size_t size = 0; size <= log.size(); ++size) {
    const Read read = read_bytes(log.substr(0, size));
    EXPECT_LE(read.entries.size(), 4u);
    EXPECT_LE(read.troubles.size(), 1u) << size;
    if (size == log.size()) {
      EXPECT_EQ(ids(read), (std::vector<std::uint32_t>{1, 2, 3, 4}));
      EXPECT_TRUE(read.troubles.empty());
    }
  }
  EXPECT_THAT(read_bytes(log.substr(0, log.size() - 1)).troubles, ElementsAre(HasSubstr("the log ends inside")));
  EXPECT_THAT(read_bytes("not a log at all").troubles, ElementsAre(HasSubstr("is no BLF")));
}

TEST(Blf, BehindBrokenBytesTheNextObjectIsRead) {
  std::string broken = container(message(2, 2));
  broken[40] = static_cast<char>(broken[40] ^ 0x55);  // of the packed bytes
  const Read log =
      read_bytes(log_of(container(message(1, 1)) + broken + std::string(1000, '?') + container(message(3, 3))));
  EXPECT_EQ(ids(log), (std::vector<std::uint32_t>{1, 3}));
  EXPECT_THAT(log.troubles, ElementsAre(HasSubstr("cannot be unpacked")));

  const Read inside =
      read_bytes(log_of(container(message(1, 1) + std::string(100, '?') + message(2, 2)) + container(message(3, 3))));
  EXPECT_EQ(ids(inside), (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_EQ(inside.troubles.size(), 1u);

  // A size that cannot be: the object is passed over, its frame is not believed.
  std::string short_object = message(2, 2);
  short_object.replace(8, 4, little(8));
  const Read sizes = read_bytes(log_of(container(message(1, 1) + short_object + message(3, 3))));
  EXPECT_EQ(ids(sizes), (std::vector<std::uint32_t>{1, 3}));
  std::string bomb = container(message(1, 1));
  bomb.replace(24, 4, little(0xFFFFFFFFU));  // the size of what it holds
  EXPECT_THAT(read_bytes(log_of(bomb)).troubles, ElementsAre(HasSubstr("says that it holds")));
}

}  // namespace
}  // namespace hueline::drivers
