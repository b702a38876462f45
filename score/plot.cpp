#include "score/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/printable.hpp"

namespace hueline::score {
namespace {

constexpr double kWidth = 380, kHeight = 230, kLeft = 52, kRight = 12, kTop = 26, kBottom = 40;
// Colours that people with any kind of colour vision can distinguish (Okabe and Ito).
constexpr std::array kColours{"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"};

struct Axis {
  double low = 0, high = 1;
  bool is_logarithmic = false;
  double from = 0, to = 1;  // pixels
  double operator()(double x) const {
    const double share =
        is_logarithmic ? std::log(std::max(x, low) / low) / std::log(high / low) : (x - low) / (high - low);
    return from + share * (to - from);
  }
  std::vector<double> ticks() const {
    std::vector<double> out;
    if (is_logarithmic) {
      const bool is_narrow = high / low < 100;
      for (double decade = std::pow(10, std::floor(std::log10(low))); decade <= high; decade *= 10)
        for (const double t : {decade, 2 * decade, 5 * decade})
          if (t >= low * 0.999999 && t <= high * 1.000001 && (is_narrow || t == decade)) out.push_back(t);
      return out;
    }
    const double raw = (high - low) / 4, power = std::pow(10, std::floor(std::log10(raw)));
    const double step = power * (raw / power < 1.5 ? 1 : (raw / power < 3.5 ? 2 : (raw / power < 7.5 ? 5 : 10)));
    for (double t = std::ceil(low / step - 1e-9) * step; t <= high + 1e-9 * step; t += step)
      out.push_back(std::abs(t) < 1e-9 * step ? 0 : t);
    return out;
  }
};

struct Extent {
  double low = 1e300, high = -1e300;
  void take(double x) {
    if (!std::isfinite(x)) return;
    low = std::min(low, x);
    high = std::max(high, x);
  }
};

std::string text(double x, double y, const char* anchor, const std::string& words, const char* extra = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>", x, y, anchor, extra,
                     as_markup(words));
}

void draw_curve(const Chart& chart, const Chart::Curve& curve, const char* colour, const Axis& x, const Axis& y,
                std::string& out) {
  switch (chart.kind) {
    case Chart::Kind::Lines: {
      out += fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\" points=\"", colour);
      for (const auto& [px, py] : curve.points) out += fmt::format("{:.1f},{:.1f} ", x(px), y(py));
      out += "\"/>";
      break;
    }
    case Chart::Kind::Points:
      for (std::size_t i = 0; i < curve.points.size(); ++i) {
        const auto& [px, py] = curve.points[i];
        if (i < curve.plus_minus.size())
          out += fmt::format(
              "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" stroke=\"{3}\" stroke-opacity=\".35\" "
              "stroke-width=\"3\"/>",
              x(px), y(py - curve.plus_minus[i]), y(py + curve.plus_minus[i]), colour);
        out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.4\" fill=\"{}\"/>", x(px), y(py), colour);
      }
      break;
    case Chart::Kind::Bars:
      for (const auto& [px, py] : curve.points) {
        const double half = 0.36 * (x(1) - x(0));
        out += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>",
                           x(px) - half, y(py), 2 * half, y(0) - y(py), colour);
        out += text(x(px), y(py) - 3, "middle", fmt::format("{:.2g}", py));
      }
      break;
  }
}

}  // namespace

std::string svg(const Chart& chart) {
  Extent xs, ys;
  for (const auto& curve : chart.curves)
    for (std::size_t i = 0; i < curve.points.size(); ++i) {
      const auto& [px, py] = curve.points[i];
      const double reach = i < curve.plus_minus.size() ? curve.plus_minus[i] : 0;
      xs.take(px);
      ys.take(py - reach);
      ys.take(py + reach);
    }
  std::string out = fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\">", kWidth, kHeight);
  out += text(kLeft, 16, "start", chart.title, " class=\"title\"");
  if (xs.low > xs.high) return out + text(kWidth / 2, kHeight / 2, "middle", "nothing to show") + "</svg>";

  Axis x{xs.low, xs.high, chart.is_x_logarithmic, kLeft, kWidth - kRight},
      y{ys.low, ys.high, false, kHeight - kBottom, kTop + 6};
  if (chart.kind == Chart::Kind::Bars) {
    x.low = -0.5;
    x.high = static_cast<double>(chart.bar_names.size()) - 0.5;
    y.low = 0;
    y.high = ys.high > 0 ? 1.12 * ys.high : 1;
  } else {
    if (chart.kind == Chart::Kind::Points) y.low = std::min(y.low, 0.0), y.high = std::max(y.high, 0.0);
    if (x.is_logarithmic) {
      x.low = std::max(x.low, x.high / 1e4);
      x.high = std::max(x.high, 2 * x.low);
    } else if (x.high <= x.low) {
      x.high = x.low + 1;
    }
    const double margin = y.high > y.low ? 0.05 * (y.high - y.low) : 1;
    y.low -= margin;
    y.high += margin;
  }
  for (const double t : y.ticks()) {
    out += fmt::format("<line class=\"grid\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>", kLeft,
                       kWidth - kRight, y(t));
    out += text(kLeft - 5, y(t) + 3.5, "end", fmt::format("{:g}", t));
  }
  if (chart.kind == Chart::Kind::Bars) {
    for (std::size_t i = 0; i < chart.bar_names.size(); ++i)
      out += text(x(static_cast<double>(i)), kHeight - kBottom + 14, "middle", chart.bar_names[i]);
  } else {
    for (const double t : x.ticks()) {
      out += fmt::format("<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>", x(t), kTop + 6,
                         kHeight - kBottom);
      out += text(x(t), kHeight - kBottom + 14, "middle", fmt::format("{:g}", t));
    }
  }
  for (std::size_t i = 0; i < chart.curves.size(); ++i)
    draw_curve(chart, chart.curves[i], kColours[i % kColours.size()], x, y, out);
  out += text((kLeft + kWidth - kRight) / 2, kHeight - 8, "middle", chart.x_label);
  out += fmt::format("<text transform=\"translate(11 {:.0f}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                     (kTop + kHeight - kBottom) / 2, as_markup(chart.y_label));
  double legend_y = kTop + 18;
  for (std::size_t i = 0; i < chart.curves.size(); ++i) {
    if (chart.curves[i].label.empty() || chart.curves[i].points.empty() || chart.curves.size() == 1) continue;
    out += fmt::format("<rect x=\"{}\" y=\"{:.0f}\" width=\"9\" height=\"9\" fill=\"{}\"/>", kLeft + 8, legend_y - 8,
                       kColours[i % kColours.size()]);
    out += text(kLeft + 21, legend_y, "start", chart.curves[i].label);
    legend_y += 13;
  }
  return out + "</svg>";
}

}  // namespace hueline::score
