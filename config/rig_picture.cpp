#include "config/rig_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/angle.hpp"
#include "core/printable.hpp"

namespace hueline::config {
namespace {

constexpr double kPanel = 480, kMargin = 30, kGap = 16, kAxis_px = 42;

/// A sensor, lens or head with its axes, in the frame that is drawn.
struct Drawn {
  std::string mark;  ///< short text beside it
  Eigen::Vector3d p;
  Eigen::Matrix3d axes;  ///< columns: its x, y and z axis
};

/// A direction of view: which direction of the frame points to the right in the picture, and which points up.
struct View {
  const char* title;
  Eigen::Vector3d right, up;
};

/// One view of several things. The origin of the frame is always inside.
class Panel {
 public:
  Panel(double x, double y, const View& view, const std::vector<Drawn>& things, double least_m)
      : x_(x), y_(y), view_(view) {
    Eigen::Vector2d low(-least_m / 2, -least_m / 2), high(least_m / 2, least_m / 2);
    for (const Drawn& thing : things) {
      low = low.cwiseMin(flat(thing.p));
      high = high.cwiseMax(flat(thing.p));
    }
    middle_ = (low + high) / 2;
    scale_ = (kPanel - 2 * kMargin - 2 * kAxis_px) / std::max(1e-3, (high - low).maxCoeff());
    out_ = fmt::format(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"panel\"/><text x=\"{}\" y=\"{}\" "
        "class=\"title\">{}</text>",
        x, y, kPanel, kPanel, x + 10, y + 20, view.title);
    ruler();
  }
  void draw(const Drawn& thing, bool has_lever) {
    if (has_lever) line({0, 0, 0}, thing.p, "lever");
    const char* colours[3] = {"axis_x", "axis_y", "axis_z"};
    for (int i = 0; i < 3; ++i) line(thing.p, thing.p + thing.axes.col(i) * (kAxis_px / scale_), colours[i]);
    const Eigen::Vector2d at = place(thing.p);
    out_ += fmt::format(
        "<circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"3.5\"/><text x=\"{2:.1f}\" y=\"{3:.1f}\" class=\"mark\">{4}</text>",
        at.x(), at.y(), at.x() - 14, at.y() + 16, as_markup(thing.mark));
  }
  void line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const char* kind) {
    const Eigen::Vector2d a = place(from), b = place(to);
    out_ += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"{}\"/>", a.x(), a.y(),
                        b.x(), b.y(), kind);
  }
  double px_per_m() const { return scale_; }
  const std::string& svg() const { return out_; }

 private:
  Eigen::Vector2d flat(const Eigen::Vector3d& p) const { return {p.dot(view_.right), p.dot(view_.up)}; }
  Eigen::Vector2d place(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d q = (flat(p) - middle_) * scale_;
    return {x_ + kPanel / 2 + q.x(), y_ + kPanel / 2 - q.y()};
  }
  /// Draws a ruler whose length is 1, 2 or 5 times a power of ten, about a fifth of the panel.
  void ruler() {
    const double wanted = kPanel / 5 / scale_, ten = std::pow(10.0, std::floor(std::log10(wanted)));
    const double length = wanted / ten >= 5 ? 5 * ten : wanted / ten >= 2 ? 2 * ten : ten;
    const double y = y_ + kPanel - 14, x = x_ + kPanel - 16;
    out_ += fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"ruler\"/><text x=\"{:.1f}\" "
        "y=\"{:.1f}\" class=\"mark\" text-anchor=\"end\">{:g} m</text>",
        x - length * scale_, y, x, y, x, y - 5, length);
  }

  double x_, y_;
  View view_;
  Eigen::Vector2d middle_;
  double scale_ = 1;
  std::string out_;
};

std::string numbers_row(const std::string& mark, const std::string& name, const Eigen::Vector3d& p,
                        const Eigen::Quaterniond& q, const std::string& looks) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  const double b = std::asin(std::clamp(-R(2, 0), -1.0, 1.0)) * kDegPerRad,
               a = std::atan2(R(2, 1), R(2, 2)) * kDegPerRad, c = std::atan2(R(1, 0), R(0, 0)) * kDegPerRad;
  return fmt::format("{:5} {:16} {:8.3f} {:8.3f} {:8.3f}   {:8.2f} {:8.2f} {:8.2f}   {}", mark, name.substr(0, 16),
                     p.x(), p.y(), p.z(), a, b, c, looks);
}

/// Returns where an axis points in Body, e.g. "20.0 deg from forward, +5.0 deg up".
std::string direction_text(const Eigen::Vector3d& d) {
  const double up = std::asin(std::clamp(d.z(), -1.0, 1.0)) * kDegPerRad;
  if (std::abs(up) > 75) return up > 0 ? "up" : "down";
  double heading = std::atan2(d.x(), d.y()) * kDegPerRad;
  if (heading < -0.05) heading += 360;
  return fmt::format("{:.1f} deg from forward, {:+.1f} deg up", heading, up);
}

/// What is drawn of a rig: the scanners and the head in Body, the lenses in the head, and a row of numbers for each.
struct Drawing {
  std::vector<Drawn> things, lenses;
  std::vector<std::string> rows;
};

Drawing drawing_of(const Rig& rig) {
  Drawing out;
  out.rows = {"in Body (x right, y forward, z up; origin: the POS's centre of navigation)",
              fmt::format("{:5} {:16} {:>8} {:>8} {:>8}   {:>8} {:>8} {:>8}   {}", "", "", "x m", "y m", "z m",
                          "Rx deg", "Ry deg", "Rz deg", "")};
  int number = 0;
  for (const auto& laser : rig.geometry.lasers) {
    const std::string mark = fmt::format("L{}", ++number);
    const auto& T = laser.T_body_scanner;
    out.things.push_back({mark, T.translation, T.rotation.toRotationMatrix()});
    out.rows.push_back(numbers_row(mark, rig.sensor_names()[laser.sensor], T.translation, T.rotation,
                                   "spin axis " + direction_text(T.rotation * Eigen::Vector3d::UnitZ())));
  }
  const auto& head = rig.geometry.head;
  if (head.lenses.empty()) return out;
  const auto& T = head.T_body_head;
  out.things.push_back({"H", T.translation, T.rotation.toRotationMatrix()});
  out.rows.push_back(numbers_row("H", "head", T.translation, T.rotation,
                                 "x axis " + direction_text(T.rotation * Eigen::Vector3d::UnitX())));
  out.rows.emplace_back();
  out.rows.emplace_back("in the head (x forward, y left, z up); directions in Body");
  for (std::size_t i = 0; i < head.lenses.size(); ++i) {
    const auto& T_head_lens = head.lenses[i].T_head_lens;
    const std::string mark = std::to_string(i);
    out.lenses.push_back({mark, T_head_lens.translation, T_head_lens.rotation.toRotationMatrix()});
    out.rows.push_back(
        numbers_row(mark, head.lenses[i].name, T_head_lens.translation, T_head_lens.rotation,
                    "looks " + direction_text(T.rotation * (T_head_lens.rotation * Eigen::Vector3d::UnitZ()))));
  }
  return out;
}

/// Returns the two views of the things in Body, side by side.
std::string body_panels(const std::vector<Drawn>& things, double y) {
  const View plan{"from above, forward is up", {1, 0, 0}, {0, 1, 0}},
      side{"from the right, forward is right", {0, 1, 0}, {0, 0, 1}};
  std::string out;
  double x = kMargin;
  for (const View& view : {plan, side}) {
    Panel panel(x, y, view, things, 1.0);
    panel.draw({"Body", Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()}, false);
    for (const Drawn& thing : things) panel.draw(thing, true);
    out += panel.svg();
    x += kPanel + kGap;
  }
  return out;
}

/// Returns the two views of the lenses in their head, side by side.
std::string head_panels(const std::vector<Drawn>& lenses, double y) {
  const View plan{"the head from above, its x is up", {0, -1, 0}, {1, 0, 0}},
      side{"the head from its right, its x is right", {1, 0, 0}, {0, 0, 1}};
  std::string out;
  double x = kMargin;
  for (const View& view : {plan, side}) {
    Panel panel(x, y, view, lenses, 0.05);
    panel.draw({"H", Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity() * 0.6}, false);
    for (const Drawn& lens : lenses) {
      panel.draw(lens, true);
      panel.line(lens.p, lens.p + lens.axes.col(2) * (2.0 * kAxis_px / panel.px_per_m()), "sight");
    }
    out += panel.svg();
    x += kPanel + kGap;
  }
  return out;
}

/// Returns the beginning of the page: its size, the styles and the title.
std::string page_head(const std::string& title, double width, double height) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
      "{1:.0f}\"><style>"
      "text{{font:13px "
      "sans-serif;fill:#222}}.head{{font-size:20px}}.title{{font-size:12px;fill:#666}}.row{{font:12.5px "
      "monospace}}"
      ".panel{{fill:#fbfbfb;stroke:#ccc}}line{{stroke-width:2.2;stroke-linecap:round}}.axis_x{{stroke:#d0312d}}."
      "axis_y{{stroke:#2e8b3d}}"
      ".axis_z{{stroke:#2b5fc0}}.lever{{stroke:#999;stroke-width:1;stroke-dasharray:4 4}}.ruler{{stroke:#444}}"
      ".sight{{stroke:#2b5fc0;stroke-width:1;stroke-dasharray:2 4}}.mark{{font-size:12px}}</style><rect "
      "width=\"100%\" height=\"100%\" fill=\"#fff\"/>"
      "<text x=\"{2}\" y=\"34\" class=\"head\">{3}</text><text x=\"{4:.0f}\" y=\"34\" text-anchor=\"end\" "
      "class=\"title\">axes: x red, y green, z blue; dashed: lever arms</text>",
      width, height, kMargin, as_markup(title), width - kMargin);
}

}  // namespace

std::string rig_svg(const Rig& rig) {
  const Drawing drawing = drawing_of(rig);
  double y = 50;
  std::string body = body_panels(drawing.things, y);
  y += kPanel + kGap;
  if (!drawing.lenses.empty()) {
    body += head_panels(drawing.lenses, y);
    y += kPanel + kGap;
  }
  y += 16;
  for (const std::string& row : drawing.rows) {
    if (!row.empty())
      body += fmt::format("<text x=\"{}\" y=\"{:.0f}\" class=\"row\" xml:space=\"preserve\">{}</text>", kMargin, y,
                          as_markup(row));
    y += 17;
  }
  return page_head(rig.name, 2 * kMargin + 2 * kPanel + kGap, y + 10) + body + "</svg>\n";
}

}  // namespace hueline::config
