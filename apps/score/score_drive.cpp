#include "apps/score/score_drive.hpp"

#include <string>

#include "apps/score/sink_group.hpp"
#include "apps/score/view_judges.hpp"
#include "config/section.hpp"
#include "score/metric_table.hpp"

namespace hueline::apps {

ScoredDrive score_drive(DriveSource& source, const std::string& name, int threads, ProgressBar& bar) {
  if (source.rig.geometry.head.lenses.empty() || source.rig.geometry.lasers.empty())
    throw config::ConfigError("the figures of a recording need a rig with a camera head and a scanner");
  ScoredDrive out;
  out.score.scenario = name;
  // How a camera encodes light is not in a recording. Nearly all images that people look at are sRGB.
  ViewJudges views(source.rig, threads, score::LabOfRgb::Encoding::Srgb);
  SinkGroup sinks(views.sinks());
  out.read = source.feed_without_colours(bar, source.rig, sinks);
  views.report(out.score);
  for (const score::Metric& metric : score::metrics())
    out.score.figures.try_emplace(metric.name, score::Figure{{}, "a recording has no truth"});
  return out;
}

}  // namespace hueline::apps
