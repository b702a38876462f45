#include "score/ciede2000.hpp"

#include <cmath>

#include "core/angle.hpp"

namespace hueline::score {
namespace {

constexpr double kPi = 3.14159265358979323846;

double power7(double x) {
  const double x3 = x * x * x;
  return x3 * x3 * x;
}

/// Returns the hue, equation (7): rad, [0, 2 pi); 0 for grey.
double hue(double a, double b) {
  if (a == 0 && b == 0) return 0;
  const double h = std::atan2(b, a);
  return h < 0 ? h + 2 * kPi : h;
}

/// Returns the function of CIE 15: a cube root that is straight near zero.
double foot(double t) {
  constexpr double kEdge = 216.0 / 24389.0, kSlope = 24389.0 / 27.0;
  return t > kEdge ? std::cbrt(t) : (kSlope * t + 16) / 116;
}

}  // namespace

double ciede2000(Lab one, Lab other) {
  // (2)-(6): a is stretched, so that greys become round.
  const double mean_C = (std::hypot(one.a, one.b) + std::hypot(other.a, other.b)) / 2;
  const double C7 = power7(mean_C), G = 0.5 * (1 - std::sqrt(C7 / (C7 + power7(25))));
  const double a1 = (1 + G) * one.a, a2 = (1 + G) * other.a;
  const double C1 = std::hypot(a1, one.b), C2 = std::hypot(a2, other.b);
  const double h1 = hue(a1, one.b), h2 = hue(a2, other.b);

  // (8)-(11)
  const bool is_grey = C1 * C2 == 0;
  double dh = is_grey ? 0 : h2 - h1;
  if (dh > kPi) dh -= 2 * kPi;
  if (dh < -kPi) dh += 2 * kPi;
  const double dL = other.L - one.L, dC = C2 - C1, dH = 2 * std::sqrt(C1 * C2) * std::sin(dh / 2);

  // (12)-(14)
  const double L = (one.L + other.L) / 2, C = (C1 + C2) / 2;
  double h = h1 + h2;
  if (!is_grey) {
    if (std::abs(h1 - h2) > kPi) h += h < 2 * kPi ? 2 * kPi : -2 * kPi;
    h /= 2;
  }

  // (15)-(21)
  const double T = 1 - 0.17 * std::cos(h - 30 * kRadPerDeg) + 0.24 * std::cos(2 * h) +
                   0.32 * std::cos(3 * h + 6 * kRadPerDeg) - 0.20 * std::cos(4 * h - 63 * kRadPerDeg);
  const double from_blue = (h / kRadPerDeg - 275) / 25, turn = 30 * kRadPerDeg * std::exp(-from_blue * from_blue);
  const double chroma7 = power7(C), R_C = 2 * std::sqrt(chroma7 / (chroma7 + power7(25)));
  const double middle = (L - 50) * (L - 50);
  const double S_L = 1 + 0.015 * middle / std::sqrt(20 + middle), S_C = 1 + 0.045 * C, S_H = 1 + 0.015 * C * T;
  const double R_T = -std::sin(2 * turn) * R_C;

  // (22)
  const double l = dL / S_L, c = dC / S_C, k = dH / S_H;
  return std::sqrt(std::fmax(0.0, l * l + c * c + k * k + R_T * c * k));
}

LabOfRgb::LabOfRgb(Encoding encoding) {
  for (std::size_t i = 0; i < light_.size(); ++i) {
    const double x = static_cast<double>(i) / 255;
    light_[i] = encoding == Encoding::Linear
                    ? x
                    : (x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));  // IEC 61966-2-1
  }
}

Lab LabOfRgb::of_light(const std::array<double, 3>& light) {
  const double r = light[0], g = light[1], b = light[2];
  // IEC 61966-2-1. The white is the sum of each row, so that greys are grey to the last bit.
  constexpr double m[3][3] = {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
  const auto row = [&](int i) {
    return foot((m[i][0] * r + m[i][1] * g + m[i][2] * b) / (m[i][0] + m[i][1] + m[i][2]));
  };
  const double x = row(0), y = row(1), z = row(2);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

}  // namespace hueline::score
