// The kernel beside a plain computation of the same returns, one after the other, on random packets of each form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/portable_math.hpp"
#include "drivers/livox/livox_kernel.hpp"
#include "tests/drivers/livox/livox_packets.hpp"
#include "tests/drivers/same_returns.hpp"
#include "tests/support/each_instruction_set.hpp"

namespace hueline::drivers {
namespace {

constexpr double kNearest = 0.3;

std::vector<LaserReturn> plain(const LivoxPacket& packet, double interval_ns, double farthest) {
  std::vector<LaserReturn> out;
  for (std::size_t firing = 0; firing < packet.points; ++firing) {
    std::vector<LaserReturn> found;
    for (std::size_t which = 0; which < packet.form->returns; ++which) {
      const LivoxReturn one = read_livox_return(packet, firing, which);
      double x = one.said[0], y = one.said[1], z = one.said[2];
      if (packet.form->is_spherical) {
        const double range = one.said[0], zenith = one.said[1], azimuth = one.said[2];
        x = range * portable::sin(zenith) * portable::cos(azimuth);
        y = range * portable::sin(zenith) * portable::sin(azimuth);
        z = range * portable::cos(zenith);
      }
      const double range = std::sqrt(x * x + y * y + z * z), azimuth = portable::atan2(y, x);
      LaserReturn made;
      made.x = static_cast<float>(-y);
      made.y = static_cast<float>(x);
      made.z = static_cast<float>(z);
      made.range_m = static_cast<float>(range);
      made.azimuth = static_cast<float>(azimuth < 0 ? azimuth + 2 * std::numbers::pi : azimuth);
      made.time_offset_ns = static_cast<std::int32_t>(std::lround(interval_ns * static_cast<double>(firing)));
      made.reflectivity = one.reflectivity;
      const auto is_same = [&](const LaserReturn& r) { return r.x == made.x && r.y == made.y && r.z == made.z; };
      if (range != 0 && std::ranges::none_of(found, is_same)) found.push_back(made);
    }
    std::ranges::stable_sort(found, {}, &LaserReturn::range_m);
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i].return_number = static_cast<std::uint8_t>(i + 1);
      found[i].return_count = static_cast<std::uint8_t>(found.size());
      if (found[i].range_m >= kNearest && found[i].range_m <= farthest) out.push_back(found[i]);
    }
  }
  return out;
}

/// Points whose numbers are random, small, or zero; some firings have a return twice.
test::Bytes random_points(test::RandomPackets& random, std::size_t count, std::size_t point_bytes) {
  test::Bytes out(count * point_bytes);
  for (std::size_t k = 0; k < count; ++k) {
    const bool is_empty = random.one_in(5), is_small = random.one_in(2), is_along = random.one_in(8),
               is_upwards = random.one_in(8);  // by the zenith of the forms whose range comes first
    for (std::size_t i = 0; i < point_bytes; ++i) {
      const bool is_zero =
          is_empty || (is_along && i >= 4 && i < 12) || (is_upwards && (i == 4 || i == 5)) || (is_small && i % 4 >= 2);
      out[k * point_bytes + i] = static_cast<std::byte>(is_zero ? 0 : random.below(256));
    }
    if (point_bytes >= 28 && random.one_in(3)) std::copy_n(&out[k * point_bytes], 13, &out[k * point_bytes + 14]);
  }
  return out;
}

TEST(LivoxKernel, MakesTheReturnsOfAPlainComputationToTheLastBit) {
  test::with_each_instruction_set([] {
    test::RandomPackets random(14);
    std::size_t compared = 0;
    struct Form {
      unsigned number, points, point_bytes;  ///< points: 0 for the second generation
    };
    for (const Form form :
         {Form{0, 100, 13}, Form{1, 100, 9}, Form{2, 96, 14}, Form{3, 96, 10}, Form{4, 48, 28}, Form{5, 48, 16},
          Form{7, 30, 42}, Form{8, 30, 22}, Form{1, 0, 14}, Form{2, 0, 8}, Form{3, 0, 10}, Form{0x11, 0, 28}})
      for (int i = 0; i < 40; ++i) {
        const unsigned count = form.points ? form.points : 1 + random.below(100);
        const test::Bytes points = random_points(random, count, form.point_bytes);
        test::LivoxFirst first;
        first.data_type = form.number;
        test::LivoxSecond second;
        second.data_type = form.number;
        const test::Bytes bytes = form.points ? first.bytes(points) : second.bytes(points, count);
        const auto packet = decode_livox(bytes);
        ASSERT_TRUE(packet);
        const double farthest = random.one_in(2) ? 1e9 : 30.0, interval_ns = 0.25 * random.below(100'000);
        LivoxKernel kernel(kNearest, farthest);
        std::vector<LaserReturn> returns;
        kernel.decode(*packet, interval_ns, returns);
        test::expect_same(returns, plain(*packet, interval_ns, farthest));
        compared += returns.size();
        if (testing::Test::HasFatalFailure()) FAIL() << packet->form->name << ", form " << form.number;
      }
    EXPECT_GT(compared, 10'000u);
  });
}

}  // namespace
}  // namespace hueline::drivers
