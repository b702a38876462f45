#include "fusion/radiometry.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/portable_math.hpp"

namespace hueline::fusion {
namespace {

constexpr std::size_t kMostShots = 64;      // moments that are remembered
constexpr std::size_t kMostUnsettled = 16;  // limits the size of a solution
constexpr std::size_t kRed = 0, kGreen = 1, kBlue = 2;
constexpr std::size_t kEnough = 24;     // smallest number of common places of a pair
constexpr double kPlaceNoise = 0.03;    // least standard deviation of a place's logarithm of light
constexpr double kPairNoise = 0.005;    // what a pair's places have in common: gloss, blur, response
constexpr double kBalance = 0.1;        // of red and blue against green, from lens to lens
constexpr double kBalanceNoise = 0.01;  // of red and blue against green, from one moment to the next
constexpr double kStep = 0.1;           // change of a gain against the change of the others
constexpr double kRange = 1.0;          // distance of a gain from the reference
constexpr double kReference = 1e-4;     // of the first lens in the first moment: it is the reference
constexpr double kHeld = 0.003;         // of a gain that nothing has changed
constexpr double kReleased = 0.02;      // a gain that differs by more has been changed
constexpr double kFalloff = 0.3;        // prior standard deviation of each term of the vignetting
constexpr auto kLargestTable = static_cast<std::size_t>(RenderTables::kLargest);

constexpr double kMiddleGrey = 0.16;  // where Evened puts the median of the light
constexpr double kEvened = 0.75;      // share of the logarithmic difference that Evened removes
constexpr double kSlow_s = 2.0;       // half width of the time over which Evened takes the mean
constexpr float kShoulder = RenderTables::kShoulder;

double sq(double x) { return x * x; }

double decoded(Response response, double gamma, double x) {
  switch (response) {
    case Response::Linear:
      return x;
    case Response::Gamma:
      return portable::pow(x, gamma);
    case Response::Srgb:
      break;
  }
  return x <= 0.04045 ? x / 12.92 : portable::pow((x + 0.055) / 1.055, 2.4);
}

double srgb(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * portable::pow(x, 1 / 2.4) - 0.055; }

double middle(std::vector<double>& values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

void Radiometry::Config::visit(Keys& keys) {
  keys.choice(
      {"rendering", "",
       "What becomes of the light of the images. `consistent`: one gain for the whole drive, so a tunnel is as "
       "dark as it was. `evened`: brightened and darkened slowly along the drive, to be looked at. "
       "`as_delivered`: as each lens chose its gain."},
      rendering,
      {{"consistent", Rendering::Consistent}, {"evened", Rendering::Evened}, {"as_delivered", Rendering::AsDelivered}});
  keys.choice({"response", "", "How the cameras' pixel values encode light: the sRGB curve, linear, or a power."},
              response, {{"srgb", Response::Srgb}, {"linear", Response::Linear}, {"gamma", Response::Gamma}});
  keys.number({"gamma", "", "For `response: gamma`: light is the pixel's value to the power of this."}, gamma,
              {0.3, 4});
}

Radiometry::Radiometry(const Config& config, std::size_t lenses)
    : config_(config),
      lenses_(lenses),
      balance_(lenses),
      balance_count_(lenses),
      held_(lenses),
      told_(lenses),
      coded_(kLargestTable + 1) {
  for (std::size_t i = 0; i < linear_.size(); ++i)
    linear_[i] =
        static_cast<float>(decoded(config.response, config.gamma, std::min(1.0, static_cast<double>(i) / 255.0)));
  for (std::size_t i = 0; i < coded_.size(); ++i)
    coded_[i] = static_cast<std::uint8_t>(std::lround(255 * srgb(static_cast<double>(i) / kLargestTable)));
  falloff_.fill(Eigen::Vector2d::Zero());
  falloff_H_.fill(Eigen::Matrix2d::Identity() / sq(kFalloff));
  falloff_h_.fill(Eigen::Vector2d::Zero());
}

std::size_t Radiometry::index_of(std::uint64_t moment) const {
  // From the newest, because most questions are about the last few.
  for (std::size_t i = shots_.size(); i-- > 0;)
    if (shots_[i].moment == moment) return i;
  return shots_.size();
}

/// Returns the logarithm of each lens's reported gain: duration times amplification. What is not reported now is what
/// it was when it was reported last.
std::vector<double> Radiometry::told_gains(std::span<const ReportedExposure> reported) {
  const auto take = [](std::optional<double>& last, std::optional<double>& first, double value) {
    if (!(value > 0)) return;
    last = portable::log(value);
    if (!first) first = last;
  };
  std::vector<double> out(lenses_, 0);
  for (std::size_t l = 0; l < lenses_; ++l) {
    Told& told = told_[l];
    if (l < reported.size()) {
      take(told.duration, first_told_.duration, to_seconds(reported[l].duration));
      take(told.gain, first_told_.gain, static_cast<double>(reported[l].gain));
    }
    if (told.duration) out[l] += *told.duration - *first_told_.duration;
    if (told.gain) out[l] += *told.gain - *first_told_.gain;
  }
  return out;
}

void Radiometry::add(std::uint64_t moment, GpsTime time, std::span<const Place> places,
                     std::span<const ReportedExposure> reported) {
  Shot shot;
  shot.moment = moment;
  shot.time = time;
  shot.gain.resize(lenses_);
  shot.told = told_gains(reported);
  shot.is_seen.resize(lenses_);
  differences_.clear();
  for (const Place& place : places) {
    for (const Glimpse& a : place) {
      if (a.moment != moment) continue;
      for (const Glimpse& b : place) {
        const bool is_same = b.moment == moment;
        const std::size_t at_b = is_same ? shots_.size() : index_of(b.moment);
        // Two lenses of the moment itself are compared once.
        if (is_same ? b.lens <= a.lens : at_b == shots_.size()) continue;
        const double told = shot.told[a.lens] - (is_same ? shot : shots_[at_b]).told[b.lens];
        const double q = static_cast<double>(a.off_axis) - b.off_axis,
                     q2 = sq(static_cast<double>(a.off_axis)) - sq(static_cast<double>(b.off_axis));
        auto& differences = differences_[{View{a.moment, a.lens}, View{b.moment, b.lens}}];
        for (std::size_t c = 0; c < 3; ++c)
          if (a.light[c] > 0 && b.light[c] > 0)
            differences[c].push_back(
                {portable::log(static_cast<double>(a.light[c]) / static_cast<double>(b.light[c])) - told, q, q2});
      }
      // Green is nearest to luminance.
      if (a.light[kGreen] > 0) shot.levels.push_back({portable::log(static_cast<double>(a.light[kGreen])), a.lens});
    }
  }
  shots_.push_back(std::move(shot));
  for (auto& [views, differences] : differences_)
    for (int c = 0; c < 3; ++c) compare(views.first, views.second, c, differences[static_cast<std::size_t>(c)]);
}

void Radiometry::compare(const View& a, const View& b, int channel, std::vector<Difference>& differences) {
  if (differences.size() < kEnough) {
    ++pairs_too_few_;
    return;
  }
  ++pairs_used_;
  const Eigen::Vector2d& falloff = falloff_[static_cast<std::size_t>(channel)];
  std::vector<double> values;
  values.reserve(differences.size());
  const auto residual = [&](const Difference& d) { return d.light + falloff[0] * d.q + falloff[1] * d.q2; };
  for (const Difference& d : differences) values.push_back(residual(d));
  // What moves, shadows that moved, outlines and gloss disturb some of the places. The median does not see them.
  const double centre = middle(values);
  for (double& x : values) x = std::abs(x - centre);
  const double sigma = std::max(kPlaceNoise, 1.4826 * middle(values));
  std::size_t count = 0;
  Pair pair{a, b, channel};
  for (const Difference& d : differences) {
    const double far = (residual(d) - centre) / (4.685 * sigma);
    if (std::abs(far) >= 1) continue;
    const double weight = sq(1 - far * far);  // Tukey
    const Eigen::Vector3d row(1, -d.q, -d.q2);
    pair.H += weight * row * row.transpose();
    pair.h += weight * d.light * row;
    ++count;
  }
  const double scale = 1 / (sq(sigma) + static_cast<double>(count) * sq(kPairNoise));
  for (const View& view : {a, b}) shots_[index_of(view.moment)].is_seen[view.lens] = true;
  pair.H *= scale;
  pair.h *= scale;
  pairs_.push_back(pair);
}

Radiometry::System Radiometry::assemble(std::size_t channel, std::size_t first, std::size_t last, bool use_held) const {
  const auto shots = last - first;
  const auto views = static_cast<Eigen::Index>(shots * lenses_), size = views + 2;
  System system{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  Eigen::MatrixXd& H = system.H;
  Eigen::VectorXd& h = system.h;
  H.bottomRightCorner<2, 2>() = falloff_H_[channel];
  h.tail<2>() = falloff_h_[channel];
  const auto expect = [&](Eigen::Index i, double value, double sigma) {
    H(i, i) += 1 / sq(sigma);
    h(i) += value / sq(sigma);
  };
  for (std::size_t s = 0; s < shots; ++s) {
    const Shot& shot = shots_[first + s];
    for (std::size_t l = 0; l < lenses_; ++l) {
      const auto i = static_cast<Eigen::Index>(s * lenses_ + l);
      if (!held_[l] && l == 0 && first + s == 0) expect(i, 0, kReference);
      if (channel != kGreen) {
        // A gain acts on all channels alike. Their relation belongs to the lens.
        expect(i, shot.gain[l][kGreen] + balance_[l][channel],
               std::sqrt(sq(kBalanceNoise) + sq(kBalance) / (1 + balance_count_[l])));
        continue;
      }
      expect(i, 0, kRange);
      if (held_[l] && use_held && shot.is_seen[l])
        expect(i, *held_[l], std::sqrt(sq(kHeld) + sq(shot.gain[l][kGreen] - *held_[l])));
      if (s > 0) {
        const auto before = i - static_cast<Eigen::Index>(lenses_);
        const double w = 1 / sq(kStep);
        H(i, i) += w;
        H(before, before) += w;
        H(i, before) -= w;
        H(before, i) -= w;
        h(i) += w * shot.common_change;
        h(before) -= w * shot.common_change;
      } else if (first > 0) {
        expect(i, shots_[first - 1].gain[l][channel] + shot.common_change, kStep);
      }
    }
  }
  for (const Pair& pair : pairs_) {
    const std::size_t at_a = index_of(pair.a.moment), at_b = index_of(pair.b.moment);
    if (static_cast<std::size_t>(pair.channel) != channel || at_b == shots_.size() || at_a < first || at_a >= last)
      continue;
    const auto a = static_cast<Eigen::Index>((at_a - first) * lenses_ + pair.a.lens);
    const bool is_b_known = at_b < first;
    const double w = pair.H(0, 0);
    Eigen::Vector3d known = pair.h;
    if (is_b_known) known += shots_[at_b].gain[pair.b.lens][channel] * pair.H.col(0);
    const auto couple = [&](Eigen::Index i, double sign) {
      H(i, i) += w;
      h(i) += sign * known[0];
      for (Eigen::Index k = 0; k < 2; ++k) {
        H(i, views + k) += sign * pair.H(0, 1 + k);
        H(views + k, i) += sign * pair.H(0, 1 + k);
      }
    };
    couple(a, 1);
    if (!is_b_known) {
      const auto b = static_cast<Eigen::Index>((at_b - first) * lenses_ + pair.b.lens);
      couple(b, -1);
      H(a, b) -= w;
      H(b, a) -= w;
    }
    H.bottomRightCorner<2, 2>() += pair.H.bottomRightCorner<2, 2>();
    h.tail<2>() += known.tail<2>();
  }
  return system;
}

void Radiometry::solve(std::size_t channel, std::size_t first, bool use_held) {
  const System system = assemble(channel, first, shots_.size(), use_held);
  const Eigen::VectorXd x = system.H.ldlt().solve(system.h);
  for (std::size_t s = first; s < shots_.size(); ++s)
    for (std::size_t l = 0; l < lenses_; ++l)
      shots_[s].gain[l][channel] = x(static_cast<Eigen::Index>((s - first) * lenses_ + l));
  falloff_[channel] = x.tail<2>();
}

void Radiometry::keep_falloff(std::size_t channel, std::size_t first, std::size_t last) {
  // What these moments say of the vignetting is kept, whatever their gains are.
  const System system = assemble(channel, first, last, false);
  const Eigen::Index views = system.H.rows() - 2;
  const Eigen::MatrixXd across = system.H.topRightCorner(views, 2);
  const Eigen::LDLT<Eigen::MatrixXd> gains(system.H.topLeftCorner(views, views));
  falloff_H_[channel] = system.H.bottomRightCorner<2, 2>() - across.transpose() * gains.solve(across);
  falloff_h_[channel] = system.h.tail<2>() - across.transpose() * gains.solve(system.h.head(views).eval());
}

void Radiometry::learn_lenses(const Shot& shot) {
  constexpr int kSlowest = 1000;
  for (std::size_t l = 0; l < lenses_; ++l) {
    const double green = shot.gain[l][kGreen];
    if (!held_[l] || std::abs(green - *held_[l]) > kReleased) held_[l] = green;
    balance_count_[l] = std::min(balance_count_[l] + 1, kSlowest);
    for (std::size_t c = 0; c < 3; ++c)
      balance_[l][c] += (shot.gain[l][c] - green - balance_[l][c]) / (1 + balance_count_[l]);
  }
  // The first lens is the reference of the colours' balance too: it must not drift.
  const Logs reference = balance_[0];
  for (Logs& balance : balance_)
    for (std::size_t c = 0; c < 3; ++c) balance[c] -= reference[c];
}

void Radiometry::find_common_change(const Shot& before, Shot& shot) {
  std::vector<double> changes;
  for (std::size_t l = 0; l < lenses_; ++l)
    if (before.is_seen[l] && shot.is_seen[l]) changes.push_back(shot.gain[l][kGreen] - before.gain[l][kGreen]);
  shot.common_change = changes.empty() ? 0 : middle(changes);
}

void Radiometry::measure_level(Shot& shot) {
  if (shot.levels.size() < kEnough) return;
  std::vector<double> light(shot.levels.size());
  for (std::size_t i = 0; i < light.size(); ++i)
    light[i] = shot.levels[i].light - shot.gain[shot.levels[i].lens][kGreen] - shot.told[shot.levels[i].lens];
  shot.level = middle(light);
}

std::vector<std::pair<std::uint64_t, HeadGains>> Radiometry::settle(GpsTime until) {
  std::vector<std::pair<std::uint64_t, HeadGains>> changed;
  const auto first = static_cast<std::size_t>(
      std::find_if(shots_.begin(), shots_.end(), [](const Shot& s) { return !s.is_settled; }) - shots_.begin());
  if (first == shots_.size()) return changed;
  solve(kGreen, first, false);
  for (std::size_t s = std::max<std::size_t>(first, 1); s < shots_.size(); ++s)
    find_common_change(shots_[s - 1], shots_[s]);
  // A gain that is nearly what it was is what it was. What is far from it is hardly drawn towards it.
  solve(kGreen, first, true);
  for (const std::size_t channel : {kRed, kBlue}) solve(channel, first, false);
  std::size_t last = first;
  while (last < shots_.size() && (shots_[last].time <= until || shots_.size() - last > kMostUnsettled)) ++last;
  for (std::size_t s = first; s < shots_.size(); ++s) {
    measure_level(shots_[s]);
    HeadGains gains;
    gains.lenses.resize(lenses_);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t l = 0; l < lenses_; ++l)
        gains.lenses[l].scale[c] = static_cast<float>(portable::exp(-shots_[s].gain[l][c] - shots_[s].told[l]));
      gains.falloff[c] = {static_cast<float>(falloff_[c][0]), static_cast<float>(falloff_[c][1])};
    }
    changed.emplace_back(shots_[s].moment, std::move(gains));
  }
  if (last == first) return changed;
  for (const std::size_t channel : {kGreen, kRed, kBlue}) keep_falloff(channel, first, last);
  for (std::size_t s = first; s < last; ++s) {
    shots_[s].is_settled = true;
    learn_lenses(shots_[s]);
  }
  // The first of a pair is the later one.
  std::erase_if(pairs_, [&](const Pair& pair) { return index_of(pair.a.moment) < last; });
  while (shots_.size() > kMostShots) shots_.pop_front();
  return changed;
}

std::array<float, 3> Radiometry::linear(const Rgb& pixel) const {
  const auto one = [&](float value) {
    const float x = std::clamp(value, 0.0f, 255.0f);
    const auto whole = static_cast<std::size_t>(x);
    return linear_[whole] + (x - static_cast<float>(whole)) * (linear_[whole + 1] - linear_[whole]);
  };
  return {one(pixel.red), one(pixel.green), one(pixel.blue)};
}

float Radiometry::adaptation(GpsTime time) const {
  if (config_.rendering != Rendering::Evened) return 1;
  double sum = 0, weights = 0, nearest = 1e9, level_of_nearest = portable::log(kMiddleGrey);
  for (const Shot& shot : shots_) {
    if (!shot.level) continue;
    const double away = std::abs(to_seconds(shot.time - time));
    if (away < nearest) {
      nearest = away;
      level_of_nearest = *shot.level;
    }
    const double weight = std::max(0.0, 1 - sq(away / kSlow_s));
    sum += weight * *shot.level;
    weights += weight;
  }
  const double level = weights > 0 ? sum / weights : level_of_nearest;
  return static_cast<float>(portable::exp(kEvened * (portable::log(kMiddleGrey) - level)));
}

std::array<std::uint8_t, 3> Radiometry::render(const Rgb& pixel, const HeadGains* gains, std::size_t lens,
                                               float off_axis, float adaptation) const {
  if (config_.rendering == Rendering::AsDelivered) {
    const auto byte = [](float value) { return static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); };
    return {byte(pixel.red), byte(pixel.green), byte(pixel.blue)};
  }
  std::array<float, 3> light = linear(pixel);
  if (gains != nullptr) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& [a, b] = gains->falloff[c];
      const float u = off_axis * (a + off_axis * b);
      // The exponential, to 1e-4 for what lenses lose.
      light[c] *= gains->lenses[lens].scale[c] * (1 + u * (1 + u * (0.5f + u * (1 / 6.0f + u * (1 / 24.0f)))));
    }
  }
  if (config_.rendering == Rendering::Evened) {
    const float brightest = adaptation * std::max({light[0], light[1], light[2]});
    float factor = adaptation;
    // All channels are reduced alike, so that highlights keep their hue.
    if (brightest > kShoulder) {
      const float over = (brightest - kShoulder) / (1 - kShoulder);
      factor *= (kShoulder + (1 - kShoulder) * over / (1 + over)) / brightest;
    }
    for (float& x : light) x *= factor;
  }
  std::array<std::uint8_t, 3> out{};
  for (std::size_t c = 0; c < 3; ++c)
    out[c] =
        coded_[static_cast<std::size_t>(std::clamp(light[c], 0.0f, 1.0f) * static_cast<float>(kLargestTable) + 0.5f)];
  return out;
}

}  // namespace hueline::fusion
