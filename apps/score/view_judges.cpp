#include "apps/score/view_judges.hpp"

namespace hueline::apps {

ViewJudges::ViewJudges(const config::Rig& rig, int threads, score::LabOfRgb::Encoding encoding)
    : figures_(encoding),
      held_out_(rig.colouring, rig.geometry, {.threads = threads},
                [this](const survey::PredictedView& view) {
                  pixels_.clear();
                  for (const auto& pixel : view.pixels) pixels_.push_back({pixel.predicted, pixel.seen});
                  figures_.add(pixels_);
                }),
      edges_(rig.geometry, {.together = rig.colouring.together}) {}

void ViewJudges::report(score::ScenarioScore& score) {
  held_out_.finish();
  figures_.report(score);
  const survey::DepthEdges::Counts counts = edges_.finish();
  score::add_depth_edge_figures({counts.exposures, counts.edges, counts.missed, counts.places, counts.missed_there},
                                score);
}

}  // namespace hueline::apps
