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
      const LivoxForm& form = *packet.form;
      const LivoxReturn one = read_livox_return(form, packet.data.data() + firing * form.point_bytes, which);
      const auto metres = [&](std::size_t i) {
        return static_cast<float>(one.said[i]) * (form.is_short ? 0.01f : 0.001f);
      };
      float x = metres(0), y = metres(1), z = metres(2), range = std::sqrt(x * x + y * y + z * z);
      double azimuth = portable::atan2(y, x);
      if (form.is_spherical) {
        int zenith = one.said[1] % 36000, around = one.said[2] % 36000;
        if (zenith > 18000) zenith = 36000 - zenith, around = (around + 18000) % 36000;
        const auto degrees = [](int hundredths) { return hundredths * std::numbers::pi / 18000; };
        range = metres(0), azimuth = degrees(around);
        const float across = range * static_cast<float>(portable::sin(degrees(zenith)));
        x = across * static_cast<float>(portable::cos(azimuth));
        y = across * static_cast<float>(portable::sin(azimuth));
        z = range * static_cast<float>(portable::cos(degrees(zenith)));
      }
      // What floats may differ by from the place and the range of doubles.
      const double exact[3] = {1.0 * one.said[0], 1.0 * one.said[1], 1.0 * one.said[2]};
      const double largest = form.is_spherical
                                 ? exact[0] * 0.001
                                 : std::hypot(exact[0], exact[1], exact[2]) * (form.is_short ? 0.01 : 0.001);
      EXPECT_NEAR(range, largest, 2e-7 * std::abs(largest));
      EXPECT_NEAR(std::hypot(double{x}, double{y}, double{z}), std::abs(largest), 3e-7 * std::abs(largest));
      LaserReturn made;
      made.x = -y;
      made.y = x;
      made.z = z;
      made.range_m = range;
      made.azimuth = static_cast<float>(azimuth < 0 ? azimuth + 2 * std::numbers::pi : azimuth);
      made.time_offset_ns = static_cast<std::int32_t>(std::lround(interval_ns * static_cast<double>(firing)));
      made.reflectivity = one.reflectivity;
      const auto is_same = [&](const LaserReturn& r) { return r.x == made.x && r.y == made.y && r.z == made.z; };
      if (range > 0 && std::ranges::none_of(found, is_same)) found.push_back(made);
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

TEST(LivoxKernel, MakesTheReturnsOfAPlainComputation) {
  test::SameAlways same;
  test::with_each_instruction_set([&] {
    same.begin();
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
        test::expect_close(returns, plain(*packet, interval_ns, farthest));
        same.add(returns);
        compared += returns.size();
        if (testing::Test::HasFatalFailure()) FAIL() << packet->form->name << ", form " << form.number;
      }
    EXPECT_GT(compared, 10'000u);
  });
}

}  // namespace
}  // namespace hueline::drivers
