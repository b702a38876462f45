#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Whether an exposure sees a place, where the laser points leave it open.
namespace hueline::fusion {

/// What is known of the line of sight from an exposure to a place: the elements of SightEvidence. Of what stands before
/// the head, and of what was there at the moment itself, the same five are asked (DepthMap).
enum class Evidence : std::uint8_t {
  Parallax,   ///< the angle between the lines to the place from the scanner, which saw it, and from the lens, rad
  Distance,   ///< of the place from the lens, m
  Agreement,  ///< how far the other images show what this one shows there (weigh_agreement())
  Surface,    ///< the nearness of the closed surface of what stands in the place's cell, over the place's; 0: nothing
  Nearest,    ///< the same of the nearest point in the cell
  Nearby,     ///< the same of the nearest point in the cell and the eight around it
  Before,     ///< of these nine cells, those with a point before the place
  There,      ///< of these nine cells, those whose nearest point is about as far as the place
  GlanceSurface,
  GlanceNearest,
  GlanceNearby,
  GlanceBefore,
  GlanceThere,
};
constexpr std::size_t kEvidences = 13;
constexpr std::array<const char*, kEvidences> kEvidenceWords{
    "Parallax", "Distance",      "Agreement",     "Surface",      "Nearest",      "Nearby",     "Before",
    "There",    "GlanceSurface", "GlanceNearest", "GlanceNearby", "GlanceBefore", "GlanceThere"};
using SightEvidence = std::array<float, kEvidences>;

/// What is known of many lines of sight, a row for each.
class SightTable {
 public:
  void clear() { rows_ = 0; }
  /// Adds a row, and returns its number.
  std::size_t add(const SightEvidence& evidence);
  void set(std::size_t row, Evidence about, float value) { columns_[static_cast<std::size_t>(about)][row] = value; }
  SightEvidence operator[](std::size_t row) const;
  std::size_t size() const { return rows_; }
  /// Returns the values of all rows, with room for whole vectors of kMostLanes behind them.
  const float* column(std::size_t evidence) const { return columns_[evidence].data(); }

  static constexpr std::size_t kMostLanes = 16;

 private:
  std::array<std::vector<float>, kEvidences> columns_;
  std::size_t rows_ = 0;
};

/// Five questions about a line of sight, and a value for each of their answers.
struct SightTree {
  static constexpr std::size_t kQuestions = 5;
  static constexpr std::size_t kAnswers = std::size_t{1} << kQuestions;
  /// Whether an evidence is at least this.
  struct Question {
    Evidence about;
    float least;
  };
  std::array<Question, kQuestions> questions;  ///< the first gives the highest bit of the answer
  std::array<float, kAnswers> values;          ///< what each answer adds to the log-odds
};

/// Sets for each row the natural logarithm of the odds that the exposure sees the place: the sum of the values of
/// kSightTrees (fusion/sight_trees.hpp), which were fitted to the true rays of simulated drives. How far something lies
/// before the place counts as much as that it does: the scanner saw past it, and seen from the lens it shifts against
/// the place by about parallax x (nearness ratio - 1). Uses the widest vector instructions that the processor has; the
/// results have the same bits with each of them.
void log_odds_of_sights(const SightTable& sights, std::vector<float>& out);

/// Below these log-odds a point gets no colour: three times in four and more, what the image shows is the point.
constexpr float kSeen = 1.2f;

/// A line of sight that was judged, for whoever asks how well: see Colouring::set_sight_sink().
struct JudgedSight {
  std::uint32_t point = 0;     ///< index in CloudBlock::points
  std::uint32_t exposure = 0;  ///< as ColouredPoint::exposure
  std::uint8_t lens = 0;       ///< as ColouredPoint::lens
  SightEvidence evidence{};
};

}  // namespace hueline::fusion
