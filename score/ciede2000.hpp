#pragma once

#include <array>
#include <cstdint>

/// Differences of colours as eyes see them.
namespace hueline::score {

/// CIE 1976 L*a*b* against the white D65.
struct Lab {
  double L = 0, a = 0, b = 0;
};
constexpr Lab operator+(Lab x, Lab y) { return {x.L + y.L, x.a + y.a, x.b + y.b}; }
constexpr Lab operator-(Lab x, Lab y) { return {x.L - y.L, x.a - y.a, x.b - y.b}; }
constexpr Lab operator*(double s, Lab x) { return {s * x.L, s * x.a, s * x.b}; }

/// CIEDE2000 with kL = kC = kH = 1 (CIE 142-2001; equation numbers in the source are those of Sharma, Wu, Dalal 2005).
/// About 1 is just visible side by side; above 20 nobody would call it the same colour.
double ciede2000(Lab one, Lab other);

/// 8 bits a channel -> L*a*b*, primaries of sRGB. Immutable, thread-safe.
class LabOfRgb {
 public:
  enum class Encoding { Srgb, Linear };  ///< Linear: the 8 bits are proportional to light
  explicit LabOfRgb(Encoding encoding);
  Lab operator()(std::array<std::uint8_t, 3> rgb) const;

 private:
  std::array<double, 256> light_;
};

}  // namespace hueline::score
