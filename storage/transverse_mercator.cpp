#include "storage/transverse_mercator.hpp"

#include <cmath>
#include <cstddef>

#include "core/portable_math.hpp"

namespace hueline::storage {

TransverseMercator::TransverseMercator(const Parameters& parameters) : p_(parameters) {
  const double f = p_.flattening, n = f / (2 - f);
  const double n2 = n * n, n3 = n2 * n, n4 = n3 * n, n5 = n4 * n, n6 = n5 * n;
  eccentricity_ = std::sqrt(f * (2 - f));
  radius_m_ = p_.semi_major_m / (1 + n) * (1 + n2 / 4 + n4 / 64 + n6 / 256);
  series_ = {n / 2 - 2 * n2 / 3 + 5 * n3 / 16 + 41 * n4 / 180 - 127 * n5 / 288 + 7891 * n6 / 37800,
             13 * n2 / 48 - 3 * n3 / 5 + 557 * n4 / 1440 + 281 * n5 / 630 - 1983433 * n6 / 1935360,
             61 * n3 / 240 - 103 * n4 / 140 + 15061 * n5 / 26880 + 167603 * n6 / 181440,
             49561 * n4 / 161280 - 179 * n5 / 168 + 6601661 * n6 / 7257600,
             34729 * n5 / 80640 - 3418889 * n6 / 1995840,
             212378941 * n6 / 319334400};
  along_at_origin_ = on_unit(p_.latitude, 0)[1];
}

std::array<double, 2> TransverseMercator::on_unit(double latitude, double from_meridian) const {
  using namespace portable;
  const double tangent = tan(latitude), secant = std::sqrt(1 + tangent * tangent);
  const double e = eccentricity_ * tangent / secant;
  const double s = sinh(eccentricity_ * 0.5 * log((1 + e) / (1 - e)));
  const double conformal = tangent * std::sqrt(1 + s * s) - s * secant;
  const double sine = sin(from_meridian), cosine = cos(from_meridian);
  const double ratio = std::abs(sine) / hypot(conformal, cosine);
  const double along = atan2(conformal, cosine),
               across = std::copysign(log(ratio + std::sqrt(1 + ratio * ratio)), sine);
  double sum_across = across, sum_along = along;
  for (std::size_t j = 0; j < series_.size(); ++j) {
    const double multiple = 2.0 * static_cast<double>(j + 1), growth = exp(multiple * across);
    sum_along += series_[j] * sin(multiple * along) * 0.5 * (growth + 1 / growth);
    sum_across += series_[j] * cos(multiple * along) * 0.5 * (growth - 1 / growth);
  }
  return {sum_across, sum_along};
}

std::array<double, 2> TransverseMercator::apply(const Geodetic& place) const {
  const auto [across, along] = on_unit(place.latitude, place.longitude - p_.longitude);
  return {p_.easting_m + p_.scale * radius_m_ * across,
          p_.northing_m + p_.scale * radius_m_ * (along - along_at_origin_)};
}

}  // namespace hueline::storage
