#pragma once

#include <array>
#include <cstdint>

/// Colour differences as the eye perceives them.
namespace hueline::score {

/// A colour in CIE 1976 L*a*b* with the white D65.
struct Lab {
  double L = 0, a = 0, b = 0;
};
constexpr Lab operator+(Lab x, Lab y) { return {x.L + y.L, x.a + y.a, x.b + y.b}; }
constexpr Lab operator-(Lab x, Lab y) { return {x.L - y.L, x.a - y.a, x.b - y.b}; }
constexpr Lab operator*(double s, Lab x) { return {s * x.L, s * x.a, s * x.b}; }

/// Returns the CIEDE2000 difference with kL = kC = kH = 1 (CIE 142-2001; the equation numbers in the source are those
/// of Sharma, Wu, Dalal 2005). About 1 is just visible side by side; above 20 nobody would call the two the same
/// colour.
double ciede2000(Lab one, Lab other);

/// Converts 8 bits a channel with the primaries of sRGB to L*a*b*. Immutable, thread-safe.
class LabOfRgb {
 public:
  enum class Encoding { Srgb, Linear };  ///< Linear: the 8 bits are proportional to light
  explicit LabOfRgb(Encoding encoding);
  Lab operator()(std::array<std::uint8_t, 3> rgb) const { return of_light(light(rgb)); }
  /// Returns the linear light of each channel; 1 is the light of 255.
  std::array<double, 3> light(std::array<std::uint8_t, 3> rgb) const {
    return {light_[rgb[0]], light_[rgb[1]], light_[rgb[2]]};
  }
  static Lab of_light(const std::array<double, 3>& light);

 private:
  std::array<double, 256> light_;
};

}  // namespace hueline::score
