#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/lens/lens_report.hpp"
#include "core/printable.hpp"

namespace hueline::calibration {
namespace {

constexpr double kPictureWidth = 720;

std::string picture(const LensValues& lens, const std::string& inside) {
  return fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{2}\"><rect width=\"{0}\" height=\"{1}\" class=\"frame\"/>{3}</svg>\n",
      lens.width, lens.height, kPictureWidth, inside);
}

/// Draws corners as dots with one colour a view, and the cells of the image that have none.
std::string coverage(const LensCalibration& calibration) {
  const LensValues& lens = calibration.adjusted.lens;
  constexpr int kAcross = 12, kDown = 10;
  std::vector<int> cells(kAcross * kDown);
  std::string dots;
  const double radius = lens.width / 250.0;
  for (std::size_t v = 0; v < calibration.views.size(); ++v) {
    const double hue = 360.0 * static_cast<double>(v) * 0.618034;
    for (const SeenCorner& corner : calibration.views[v].corners) {
      dots += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"hsl({:.0f},70%,45%)\"/>",
                          corner.pixel.x() + 0.5, corner.pixel.y() + 0.5, radius, std::fmod(hue, 360.0));
      const int column = std::clamp(static_cast<int>((corner.pixel.x() + 0.5) / lens.width * kAcross), 0, kAcross - 1);
      const int row = std::clamp(static_cast<int>((corner.pixel.y() + 0.5) / lens.height * kDown), 0, kDown - 1);
      ++cells[static_cast<std::size_t>(row * kAcross + column)];
    }
  }
  const auto filled = std::count_if(cells.begin(), cells.end(), [](int n) { return n > 0; });
  std::string empty;
  for (int i = 0; i < kAcross * kDown; ++i)
    if (!cells[static_cast<std::size_t>(i)])
      empty += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" class=\"empty\"/>",
                           i % kAcross * lens.width / double{kAcross}, i / kAcross * lens.height / double{kDown},
                           lens.width / double{kAcross}, lens.height / double{kDown});
  return fmt::format(
             "<h2>Where corners were seen</h2><p>{} of {} parts of the image hold a corner; the shaded ones hold none: "
             "there the lens is a guess. "
             "Widest angle from the axis: {:.1f}&deg;.</p>",
             filled, kAcross * kDown, covered_angle(calibration) * 180 / std::numbers::pi) +
         picture(lens, empty + dots);
}

/// Draws the mean residual of each part of the image as an arrow. What the model does not explain points the same way
/// in all views.
std::string residual_field(const LensCalibration& calibration) {
  const LensValues& lens = calibration.adjusted.lens;
  constexpr int kAcross = 18, kDown = 14;
  std::vector<Eigen::Vector2d> sums(kAcross * kDown, Eigen::Vector2d::Zero());
  std::vector<int> counts(kAcross * kDown);
  std::string lines;
  const double magnify = lens.width / 20.0 / std::max(1e-6, 3 * calibration.adjusted.sigma_px);
  const auto line = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& by, const char* kind) {
    const Eigen::Vector2d to = from + by * magnify;
    lines += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"{}\"/>", from.x(),
                         from.y(), to.x(), to.y(), kind);
  };
  for (std::size_t v = 0; v < calibration.views.size(); ++v)
    for (std::size_t c = 0; c < calibration.views[v].corners.size(); ++c) {
      const Eigen::Vector2d at = calibration.views[v].corners[c].pixel + Eigen::Vector2d(0.5, 0.5);
      line(at, calibration.adjusted.residuals[v][c], "one");
      const int column = std::clamp(static_cast<int>(at.x() / lens.width * kAcross), 0, kAcross - 1);
      const int row = std::clamp(static_cast<int>(at.y() / lens.height * kDown), 0, kDown - 1);
      sums[static_cast<std::size_t>(row * kAcross + column)] += calibration.adjusted.residuals[v][c];
      ++counts[static_cast<std::size_t>(row * kAcross + column)];
    }
  for (int i = 0; i < kAcross * kDown; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!counts[k]) continue;
    const Eigen::Vector2d middle((i % kAcross + 0.5) * lens.width / kAcross, (i / kAcross + 0.5) * lens.height / kDown);
    line(middle, sums[k] / counts[k], "mean");
  }
  return fmt::format(
             "<h2>Residuals</h2><p>Seen minus projected, drawn {:.0f} times as long. Thin: each corner. Thick: the "
             "mean of a part of the image, which "
             "is near nothing where the model fits.</p>",
             magnify) +
         picture(lens, lines);
}

std::string views_table(const LensCalibration& calibration) {
  std::string out = "<h2>Views</h2><table><tr><th>image</th><th>corners</th><th>rms, px</th><th></th></tr>";
  for (std::size_t v = 0; v < calibration.views.size(); ++v) {
    double sum = 0;
    for (const auto& r : calibration.adjusted.residuals[v]) sum += r.squaredNorm();
    const double rms = std::sqrt(sum / static_cast<double>(calibration.adjusted.residuals[v].size()));
    out += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{:.3f}</td><td><div class=\"bar\" style=\"width:{:.0f}px\"></div></td></tr>",
        as_markup(calibration.views[v].name), calibration.views[v].corners.size(), rms,
        std::min(300.0, 100 * rms / std::max(1e-9, calibration.adjusted.rms_px)));
  }
  return out + "</table>";
}

std::string left_out(const LensCalibration& calibration, const LensReportContext& context) {
  std::string out = "<h2>Left out</h2><ul>";
  for (const auto& text : context.unseen) out += "<li>" + as_markup(text) + "</li>";
  for (const auto& view : calibration.rejected_views)
    out += fmt::format("<li>{}: {}</li>", as_markup(view.view), as_markup(view.why));
  for (const auto& corner : calibration.rejected_corners)
    out += fmt::format("<li>{}: corner {} at ({:.1f}, {:.1f}), {:.2f} px off</li>", as_markup(corner.view),
                       corner.index, corner.pixel.x(), corner.pixel.y(), corner.error_px);
  if (context.unseen.empty() && calibration.rejected_views.empty() && calibration.rejected_corners.empty())
    out += "<li>nothing</li>";
  return out + "</ul>";
}

}  // namespace

std::string lens_html(const LensCalibration& calibration, const LensReportContext& context) {
  const AdjustedLens& adjusted = calibration.adjusted;
  std::string out =
      "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Lens calibration</title><style>"
      "body{font:15px/1.5 system-ui,sans-serif;margin:2em "
      "auto;max-width:760px;color:#222}table{border-collapse:collapse}"
      "td,th{padding:2px 12px 2px 0;text-align:left}td:nth-child(n+2){font-variant-numeric:tabular-nums}"
      ".frame{fill:#fafafa;stroke:#bbb;stroke-width:1}.empty{fill:#e8d9c8}.one{stroke:#8aa7c7;stroke-width:.8}.mean{"
      "stroke:#b3261e;stroke-width:2.5}"
      ".bar{background:#5b84b1;height:10px}</style>";
  out += fmt::format(
      "<h1>Lens calibration</h1><p>{}, {}.</p><p><b>{:.3f} px</b> rms over {} corners in {} views; a corner's "
      "coordinate has "
      "a standard deviation of {:.3f} px. The views disagree {:.1f} times as much as by that; the sigmas include "
      "it.</p>",
      as_markup(context.data), context.date, adjusted.rms_px, adjusted.observations / 2, calibration.views.size(),
      adjusted.sigma_px, adjusted.disagreement);
  if (calibration.two_lenses) out += "<p><b>" + as_markup(calibration.two_lenses->words()) + "</b></p>";
  out += fmt::format("<h2>{}, {} x {}</h2><table><tr><th></th><th>value</th><th>sigma</th></tr>",
                     name(adjusted.lens.model), adjusted.lens.width, adjusted.lens.height);
  const auto names = parameter_names(adjusted.lens.model);
  const auto values = adjusted.lens.parameters();
  for (int i = 0; i < parameter_count(adjusted.lens.model); ++i)
    out += fmt::format("<tr><td>{}</td><td>{:.6g}</td><td>{:.2g}</td></tr>", names[static_cast<std::size_t>(i)],
                       values[static_cast<std::size_t>(i)], std::sqrt(std::max(0.0, adjusted.covariance(i, i))));
  out += "</table><h2>Models</h2><table><tr><th></th><th>rms, px</th><th>rms of views held back, px</th></tr>";
  for (const ModelTrial& trial : calibration.trials)
    out += trial.predicted_rms_px
               ? fmt::format("<tr><td>{}</td><td>{:.3f}</td><td>{:.3f}</td></tr>", name(trial.model), trial.rms_px,
                             *trial.predicted_rms_px)
               : fmt::format("<tr><td>{}</td><td colspan=2>{}</td></tr>", name(trial.model), as_markup(trial.words()));
  out += "</table>";
  if (!context.reference.empty()) out += "<p>" + as_markup(context.reference) + "</p>";
  return out + coverage(calibration) + residual_field(calibration) + views_table(calibration) +
         left_out(calibration, context) + "</html>\n";
}

}  // namespace hueline::calibration
