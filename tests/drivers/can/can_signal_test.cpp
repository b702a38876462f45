#include "drivers/can/can_signal.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

#include "drivers/can/dbc.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using Data = std::array<std::uint8_t, 8>;

TEST(CanSignal, BitsAreFoundWhereTheFieldCountsThem) {
  const Data data{0x12, 0x34, 0x56, 0x78, 0x9A, 0xBC, 0xDE, 0xF0};
  const auto raw = [&](int start, int bits, BitOrder order, bool is_signed = false) {
    CanSignal signal;
    signal.start_bit = start;
    signal.bits = bits;
    signal.order = order;
    signal.is_signed = is_signed;
    EXPECT_EQ(signal.validate(8), "");
    return signal.raw(data);
  };
  EXPECT_EQ(raw(0, 16, BitOrder::Little), 0x3412);
  EXPECT_EQ(raw(7, 16, BitOrder::Big), 0x1234);
  EXPECT_EQ(raw(4, 8, BitOrder::Little), 0x41);   // upper half of byte 0, lower half of byte 1
  EXPECT_EQ(raw(3, 8, BitOrder::Big), 0x23);      // lower half of byte 0, upper half of byte 1
  EXPECT_EQ(raw(47, 16, BitOrder::Big), 0xBCDE);  // as Tesla's ESP_vehicleSpeed lies
  EXPECT_EQ(raw(62, 4, BitOrder::Big), 0xE);      // as its ESP_BCounter: bits 6 to 3 of 0xF0
  EXPECT_EQ(raw(56, 8, BitOrder::Little, true), -16);
  EXPECT_EQ(static_cast<std::uint64_t>(raw(0, 64, BitOrder::Little)), 0xF0DEBC9A78563412u);
  EXPECT_EQ(static_cast<std::uint64_t>(raw(7, 64, BitOrder::Big)), 0x123456789ABCDEF0u);
}

/// A slow version by the definition: the place of each bit.
std::uint64_t bit_by_bit(const Data& data, const CanSignal& signal) {
  std::vector<int> places;  // from the least significant
  if (signal.order == BitOrder::Little) {
    for (int i = 0; i < signal.bits; ++i) places.push_back(signal.start_bit + i);
  } else {
    const int msb = signal.start_bit / 8 * 8 + 7 - signal.start_bit % 8;  // counted from the first bit on the wire
    for (int i = signal.bits - 1; i >= 0; --i) places.push_back((msb + i) / 8 * 8 + 7 - (msb + i) % 8);
  }
  std::uint64_t out = 0;
  for (std::size_t i = 0; i < places.size(); ++i)
    out |= static_cast<std::uint64_t>(data[static_cast<std::size_t>(places[i] / 8)] >> (places[i] % 8) & 1) << i;
  return out;
}

TEST(CanSignal, AnyPlaceAndLength) {
  std::mt19937 random(5);
  int fitting = 0;
  for (int round = 0; round < 20'000; ++round) {
    Data data;
    for (auto& byte : data) byte = static_cast<std::uint8_t>(random());
    CanSignal signal;
    signal.start_bit = static_cast<int>(random() % 64);
    signal.bits = 1 + static_cast<int>(random() % 64);
    signal.order = random() & 1 ? BitOrder::Little : BitOrder::Big;
    const int wire =
        signal.order == BitOrder::Big ? signal.start_bit / 8 * 8 + 7 - signal.start_bit % 8 : signal.start_bit;
    ASSERT_EQ(signal.validate(8).empty(), wire + signal.bits <= 64) << signal.start_bit << ' ' << signal.bits;
    if (!signal.validate(8).empty()) continue;
    ++fitting;
    ASSERT_EQ(static_cast<std::uint64_t>(signal.raw(data)), bit_by_bit(data, signal));
  }
  EXPECT_GT(fitting, 5'000);
}

std::vector<DbcMessage> read_dbc(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  auto parsed = parse_dbc(text.str());
  EXPECT_TRUE(parsed.ok()) << parsed.error().message;
  return parsed.ok() ? *parsed : std::vector<DbcMessage>();
}
std::size_t signals(const std::vector<DbcMessage>& messages) {
  std::size_t sum = 0;
  for (const DbcMessage& message : messages) sum += message.signals.size();
  return sum;
}

TEST(Dbc, MakersFilesAreReadWhole) {
  HUELINE_REQUIRE_DATA("can/vw_mqb.dbc");
  const auto vw = read_dbc(data_file);
  // The expected numbers are those that grep counts for '^BO_ ' and '^ *SG_ '.
  EXPECT_EQ(vw.size(), 113u);
  EXPECT_EQ(signals(vw), 1348u);
  const auto tesla = read_dbc(test::data_dir() / "can/tesla_can.dbc");
  EXPECT_EQ(tesla.size(), 44u);
  EXPECT_EQ(signals(tesla), 572u);
  const auto gm = read_dbc(test::data_dir() / "can/gm_global_a_chassis.dbc");
  EXPECT_EQ(gm.size(), 4u);
  EXPECT_TRUE(gm[3].signals.at(3).signal.is_signed);
  // Every signal lies inside its message.
  for (const auto* file : {&vw, &gm})
    for (const DbcMessage& message : *file)
      for (const DbcSignal& signal : message.signals)
        EXPECT_EQ(signal.signal.validate(static_cast<std::size_t>(message.length)), "")
            << message.name << ' ' << signal.name;

  const auto esp = std::find_if(vw.begin(), vw.end(), [](const auto& m) { return m.name == "ESP_19"; });
  ASSERT_NE(esp, vw.end());
  EXPECT_EQ(esp->id, 178u);
  EXPECT_EQ(esp->length, 8);
  const CanSignal& left = esp->signals.at(0).signal;
  EXPECT_EQ(esp->signals[0].name, "ESP_HL_Radgeschw_02");
  EXPECT_EQ(esp->signals[0].unit, "Unit_KiloMeterPerHour");
  // 50 km/h are 6667 x 0.0075 km/h, which is 0x1A0B.
  const Data data{0x0B, 0x1A, 0, 0, 0, 0, 0, 0};
  EXPECT_DOUBLE_EQ(left.value(data), 50.0025);
  const Data all_ones{0xFF, 0xFF, 0, 0, 0, 0, 0, 0};
  EXPECT_NEAR(left.value(all_ones), 491.51, 0.005);
  EXPECT_FALSE(left.allows(left.value(all_ones))) << "the sender's mark for no value";
}

TEST(Dbc, ABrokenSignalIsRefusedWithItsReason) {
  EXPECT_TRUE(parse_dbc_signal(" SG_ a : 7|8@0- (1,-40) [0|0] \"\" X").ok());
  EXPECT_EQ(parse_dbc_signal("SG_ a M : 7|8@0+ (1e-3,-4.0E1) [-1|1] \"\" X")->signal.scale, 1e-3);
  EXPECT_TRUE(parse_dbc_signal("SG_ a m3 : 7|8@0+ (1,0) [0|0] \"\" X")->is_multiplexed);
  for (const char* broken :
       {"", "SG_", "SG_ a 7|8@0+ (1,0) [0|0] \"\"", "SG_ a : 7@0+ (1,0) [0|0] \"\"", "SG_ a : 7|8@2+ (1,0) [0|0] \"\"",
        "SG_ a : 7|8@0 (1,0) [0|0] \"\"", "SG_ a : 7|8@0+ (x,0) [0|0] \"\"", "SG_ a : 7|8@0+ (1,0) [0] \"\"",
        "SG_ a : 7|65@0+ (1,0) [0|0] \"\"", "SG_ a : 7|8@0+ (0,0) [0|0] \"\"", "SG_ a : 7|8@0+ (1,0) [0|0] \"x"})
    EXPECT_FALSE(parse_dbc_signal(broken).ok()) << broken;
  EXPECT_NE(parse_dbc("\n SG_ a : 7|8@0+ (1,0) [0|0] \"\" X\n").error().message.find("line 2"), std::string::npos);
}

TEST(CanChecksum, KnownValues) {
  // "123456789" has check values in published CRC catalogues. The byte that would hold the sum is left out.
  std::vector<std::uint8_t> digits;
  for (const char c : std::string("123456789")) digits.push_back(static_cast<std::uint8_t>(c));
  digits.push_back(0x77);
  EXPECT_EQ(can_checksum(CanChecksum::Crc8J1850, digits, 9), 0x4B);
  EXPECT_EQ(can_checksum(CanChecksum::Crc8H2f, digits, 9), 0xDF);
  EXPECT_EQ(can_checksum(CanChecksum::Xor, digits, 9), 0x31);
}

}  // namespace
}  // namespace hueline::drivers
