#include "core/fault.hpp"

#include <gtest/gtest.h>

namespace hueline {
namespace {

TEST(Fault, RoundTrip) {
  const Fault fault{3, FaultKind::Lost, host_time_ns(5), 0x1234567890ULL, "gap of the frame id"};
  const auto back = decode_fault(3, host_time_ns(5), encode_fault(fault));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->kind, fault.kind);
  EXPECT_EQ(back->count, fault.count);
  EXPECT_EQ(back->detail, fault.detail);
}

TEST(Fault, BrokenBytesAreErrors) {
  const auto bytes = encode_fault({0, FaultKind::Shed, {}, 1, ""});
  EXPECT_EQ(decode_fault(0, {}, std::span(bytes).first(8)).error().code, ErrorCode::Truncated);
  auto unknown = bytes;
  unknown[0] = std::byte{200};
  EXPECT_EQ(decode_fault(0, {}, unknown).error().code, ErrorCode::Unsupported);
}

TEST(Fault, EveryKindHasAName) {
  for (int i = 0; i < kFaultKinds; ++i) EXPECT_STRNE(name(static_cast<FaultKind>(i)), "?");
}

}  // namespace
}  // namespace hueline
