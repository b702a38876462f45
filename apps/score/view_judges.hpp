#pragma once

#include <vector>

#include "config/rig.hpp"
#include "runtime/products.hpp"
#include "score/figures.hpp"
#include "score/view_figures.hpp"
#include "survey/depth_edges.hpp"
#include "survey/held_out_views.hpp"

namespace hueline::apps {

/// The figures of a drive that need no truth: images that are left out of a second colouring, and depth edges.
/// Thread safety: none.
class ViewJudges {
 public:
  /// `threads` is the number of threads of the second colouring; the figures do not depend on it.
  ViewJudges(const config::Rig& rig, int threads, score::LabOfRgb::Encoding encoding);
  ViewJudges(const ViewJudges&) = delete;
  ViewJudges& operator=(const ViewJudges&) = delete;

  /// Returns the sinks that the pipeline has to feed.
  std::vector<runtime::ProductSink*> sinks() { return {&held_out_, &edges_}; }
  /// Adds the figures. Call it once, after the flush of the pipeline.
  void report(score::ScenarioScore& score);

 private:
  score::HeldOutFigures figures_;
  std::vector<score::HeldOutPixel> pixels_;
  survey::HeldOutViews held_out_;
  survey::DepthEdges edges_;
};

}  // namespace hueline::apps
