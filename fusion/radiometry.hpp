#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/keys.hpp"
#include "core/measurements.hpp"
#include "core/time.hpp"
#include "fusion/pixel_sampler.hpp"

namespace hueline::fusion {

/// How the camera's pixel values encode light.
enum class Response : std::uint8_t {
  Srgb,    ///< the curve of IEC 61966-2-1
  Linear,  ///< proportional to light, as most sensors deliver a raw mosaic
  Gamma,   ///< light to the power of 1 / gamma
};

/// What becomes of the light that an image recorded.
enum class Rendering : std::uint8_t {
  /// The pixel's value as the camera delivered it, whatever gain its lens had.
  AsDelivered,
  /// The light at one gain for the whole drive, so that the same surface in the same light has the same colour in all
  /// images. A tunnel is as dark as it was.
  Consistent,
  /// The consistent light, made brighter or darker slowly along the drive and with softened highlights, so that both a
  /// street and a tunnel can be looked at.
  Evened,
};

/// The gains of the lenses of one moment: all that is needed to turn a pixel into light. See
/// docs/methods/radiometry.md.
struct HeadGains {
  struct OfLens {
    std::array<float, 3> scale{1.0f, 1.0f, 1.0f};  ///< reference gain divided by the lens's gain, for each channel
  };
  std::vector<OfLens> lenses;
  /// Vignetting: a lens passes exp(-(a q + b q^2)) of the light; q is the square of the distance from the principal
  /// point, 1 at the farthest corner.
  std::array<std::array<float, 2>, 3> falloff{};
};

/// What Radiometry::render() looks up.
struct RenderTables {
  const float* linear;        ///< light for each pixel value, 0 to 256
  const std::uint8_t* coded;  ///< sRGB code for light, 0 to kLargest
  bool is_evened;
  static constexpr float kLargest = 65535.0f;
  static constexpr float kShoulder = 0.7f;  ///< from which light on Rendering::Evened softens highlights
};

/// Finds the gains of all lenses and exposures and their vignetting from what they saw of common places, while the
/// vehicle drives. Pixel values are light, coded by Response, times the gain of lens, exposure and channel, times the
/// vignetting. Two views of one place therefore differ, in logarithms, by the difference of their gains and
/// vignettings. Robust sums of these differences and weak prior knowledge are combined by least squares, channel by
/// channel (docs/methods/radiometry.md). When a moment is settled, its gains stay what they are.
///
/// What a camera reports of its gains is taken out before: only what the reports do not explain is solved for. A report
/// that is wrong, or stands still while the gain changes, therefore does no harm.
///
/// The reference is the gain of the first lens in the first moment. It never changes. The result depends on the calls
/// alone. Thread safety: one thread makes the calls that change it; const functions may then be called by many.
class Radiometry {
 public:
  struct Config {
    Rendering rendering = Rendering::Consistent;
    Response response = Response::Srgb;
    double gamma = 2.2;  ///< for Response::Gamma
    void visit(Keys& keys);
  };
  /// What one lens of one moment showed of a place.
  struct Glimpse {
    std::uint64_t moment = 0;      ///< as given to add()
    std::uint8_t lens = 0;         ///< index of the lens
    float off_axis = 0;            ///< q of HeadGains::falloff
    std::array<float, 3> light{};  ///< linear, 1 saturates; 0 if the channel is too dark, saturated or not uniform
  };
  /// What was seen of one place.
  using Place = std::vector<Glimpse>;

  Radiometry(const Config& config, std::size_t lenses);

  /// Adds a moment with what it and earlier ones showed of common places. No moment is added twice. Glimpses of moments
  /// that are not known any more are left out. `reported` has an element for each lens, or none.
  void add(std::uint64_t moment, GpsTime time, std::span<const Place> places,
           std::span<const ReportedExposure> reported = {});
  /// Finds the gains of all moments that are not settled yet, from all that was added, and returns them in the order of
  /// add(). Those of moments until `until` are settled with it; those of later moments may change with later calls.
  std::vector<std::pair<std::uint64_t, HeadGains>> settle(GpsTime until);

  /// Linearises a sampled pixel, 0 to 255.
  std::array<float, 3> linear(const Rgb& pixel) const;
  /// Returns the factor of Rendering::Evened at a time; 1 for other renderings.
  float adaptation(GpsTime time) const;
  /// Returns the colour of a pixel, 0 to 255, sRGB-coded. `gains` may be null: the pixel's light is then taken as it
  /// is.
  std::array<std::uint8_t, 3> render(const Rgb& pixel, const HeadGains* gains, std::size_t lens, float off_axis,
                                     float adaptation) const;

  /// Writes the colour of each pixel to `colours`, the same as render() returns. `lens` and `off_axis` have an element
  /// for each pixel. Uses the widest vector instructions that the processor has.
  void render_each(std::span<const Rgb> pixels, const HeadGains* gains, const std::uint8_t* lens, const float* off_axis,
                   float adaptation, std::array<std::uint8_t, 3>* colours) const;

  /// Whether a sampled value can be used to compare light: neither saturated nor too dark.
  static bool is_usable(float value) { return value >= kDarkest && value <= kBrightest; }
  static constexpr float kDarkest = 24.0f, kBrightest = 240.0f;
  /// Pairs of views that had enough common places to be compared, and those that had too few.
  std::uint64_t pairs() const { return pairs_used_; }
  std::uint64_t pairs_too_few() const { return pairs_too_few_; }

 private:
  using Logs = std::array<double, 3>;
  /// A moment and the logarithms of its lenses' gains.
  struct Shot {
    std::uint64_t moment = 0;
    GpsTime time{};
    std::vector<Logs> gain;     ///< beside what is told
    std::vector<double> told;   ///< logarithm of the gain that the camera reported, against the reference's
    std::vector<bool> is_seen;  ///< whether the lens was compared with another view
    double common_change = 0;   ///< median change of the gains that were compared, since the moment before
    bool is_settled = false;
    struct Level {
      double light = 0;  ///< logarithm, with the gain
      std::uint8_t lens = 0;
    };
    std::vector<Level> levels;
    std::optional<double> level;  ///< median logarithm of the light of the places around
  };
  /// One lens of one moment.
  struct View {
    std::uint64_t moment = 0;
    std::uint8_t lens = 0;
    auto operator<=>(const View&) const = default;
  };
  /// The common places of two views: weighted sums of the differences a - b of the logarithms of light and of the
  /// terms of the vignetting.
  struct Pair {
    View a, b;
    int channel = 0;
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();  // of (gain difference, falloff a, falloff b)
    Eigen::Vector3d h = Eigen::Vector3d::Zero();
  };
  struct Difference {
    double light = 0, q = 0, q2 = 0;
  };
  /// The normal equations of the gains of some moments and of the vignetting, in one channel.
  struct System {
    Eigen::MatrixXd H;
    Eigen::VectorXd h;
  };
  std::size_t index_of(std::uint64_t moment) const;
  std::vector<double> told_gains(std::span<const ReportedExposure> reported);
  void compare(const View& a, const View& b, int channel, std::vector<Difference>& differences);
  System assemble(std::size_t channel, std::size_t first, std::size_t last, bool use_held) const;
  void solve(std::size_t channel, std::size_t first, bool use_held);
  void keep_falloff(std::size_t channel, std::size_t first, std::size_t last);
  void learn_lenses(const Shot& shot);
  void find_common_change(const Shot& before, Shot& shot);
  void measure_level(Shot& shot);

  Config config_;
  std::size_t lenses_;
  std::deque<Shot> shots_;
  std::vector<Pair> pairs_;
  std::map<std::pair<View, View>, std::array<std::vector<Difference>, 3>> differences_;  // working memory
  std::array<Eigen::Vector2d, 3> falloff_;
  std::array<Eigen::Matrix2d, 3> falloff_H_;
  std::array<Eigen::Vector2d, 3> falloff_h_;
  std::vector<Logs> balance_;  // of each lens, against its green; that of the first lens is 0
  std::vector<int> balance_count_;
  std::vector<std::optional<double>> held_;  // gain of each lens when it last changed
  /// Logarithms of the last reported duration and gain of each lens, and of the first that was reported at all.
  struct Told {
    std::optional<double> duration, gain;
  };
  std::vector<Told> told_;
  Told first_told_;
  std::uint64_t pairs_used_ = 0, pairs_too_few_ = 0;
  std::array<float, 257> linear_{};
  std::vector<std::uint8_t> coded_;
};

}  // namespace hueline::fusion
