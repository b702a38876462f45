#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

/// Whether an exposure sees a place, where the laser points leave it open.
namespace hueline::fusion {

/// What is known of the line of sight from an exposure to a place: the elements of SightEvidence.
enum class Evidence : std::uint8_t {
  Parallax,   ///< the angle between the lines to the place from the scanner, which saw it, and from the head, rad
  Surface,    ///< the nearness of the closed surface of what stands in the place's cell, over the place's; 0: nothing
  Nearest,    ///< the same of the nearest point in the cell
  Glance,     ///< the same of the closed surface at the moment itself
  Agreement,  ///< how far the other images show what this one shows there (weigh_agreement())
};
constexpr std::size_t kEvidences = 5;
constexpr std::array<const char*, kEvidences> kEvidenceWords{"Parallax", "Surface", "Nearest", "Glance", "Agreement"};
using SightEvidence = std::array<float, kEvidences>;

/// Four questions about a line of sight, and a value for each of their sixteen answers.
struct SightTree {
  static constexpr std::size_t kQuestions = 4;
  /// Whether an evidence is at least this.
  struct Question {
    Evidence about;
    float least;
  };
  std::array<Question, kQuestions> questions;  ///< the first gives the highest bit of the answer
  std::array<float, 1U << kQuestions> values;  ///< what each answer adds to the log-odds
};

/// Returns the natural logarithm of the odds that the exposure sees the place: the sum of the values of kSightTrees
/// (fusion/sight_trees.hpp), which were fitted to the true rays of simulated drives. How far something lies before the
/// place counts as much as that it does: the scanner saw past it, and seen from the head it shifts against the place by
/// about parallax x (nearness ratio - 1).
float log_odds_of_sight(const SightEvidence& evidence);

/// Below these log-odds a point gets no colour: three times in four, what the image shows is the point.
constexpr float kSeen = 1.0f;

/// A line of sight that was judged, for whoever asks how well: see Colouring::set_sight_sink().
struct JudgedSight {
  std::uint32_t point = 0;     ///< index in CloudBlock::points
  std::uint32_t exposure = 0;  ///< as ColouredPoint::exposure
  std::uint8_t lens = 0;       ///< as ColouredPoint::lens
  SightEvidence evidence{};
};

}  // namespace hueline::fusion
