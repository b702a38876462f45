#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace {
constexpr int kSkipped = 77;  // as cmake/test_suites.cmake tells ctest
}

/// Runs the tests. A run in which a test was skipped and none failed has a status of its own, so that ctest names the
/// suite among those that were skipped; GoogleTest's status is that of success.
int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  const int status = RUN_ALL_TESTS();
  return status == 0 && testing::UnitTest::GetInstance()->skipped_test_count() > 0 ? kSkipped : status;
}
