#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/capture/trajectory_options.hpp"
#include "apps/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "apps/simulate/drive_source.hpp"
#include "apps/simulate/drive_trajectory.hpp"
#include "apps/simulate/point_claim.hpp"
#include "runtime/pipeline.hpp"
#include "runtime/recording.hpp"
#include "sim/judge.hpp"

namespace hueline::apps {
namespace {

struct VerifyOptions {
  DriveOptions drive;
  TrajectoryOptions trajectory;
  std::string method = "lens";
  double max_rms_px = 0;
  bool json = false;
};

/// Compares every coloured point and exposure with the truth.
class Judging : public runtime::ProductSink {
 public:
  Judging(sim::Judge& judge, bool is_panorama) : judge_(judge), is_panorama_(is_panorama) {}

  void on_exposure(const Exposure& exposure) override {
    if (exposure.timing == ExposureTiming::Unmatched) return;
    // The nearest true exposure is the right one, because exposures are 100 ms or more apart and stamps have errors of
    // microseconds.
    const sim::TrueExposure* nearest = nullptr;
    for (const auto& truth : judge_.exposures())
      if (!nearest || distance(truth, exposure) < distance(*nearest, exposure)) nearest = &truth;
    if (!nearest) return;
    number_of_[exposure.index] = nearest->number;
    exposure_error_us_.add(static_cast<double>(distance(*nearest, exposure)) * 1e-3);
  }

  void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override {
    const auto T_ecef_enu = ecef_from_enu(block.origin);
    for (const auto& point : block.points) {
      ++points_;
      if (point.exposure == kNoExposure) continue;
      ++coloured_;
      const auto number = number_of_.find(point.exposure);
      if (number == number_of_.end()) continue;
      judge_.add(claim_of(point, T_ecef_enu, number->second, is_panorama_));
    }
  }

  nlohmann::ordered_json json() const {
    const auto spread = [](const sim::Spread& s) {
      return nlohmann::ordered_json{
          {"rms", s.rms()}, {"median", s.quantile(0.5)}, {"p95", s.quantile(0.95)}, {"max", s.max()}};
    };
    const auto& all = judge_.all();
    nlohmann::ordered_json out;
    out["points"] = points_;
    out["coloured"] = coloured_;
    out["judged"] = all.error_px.count();
    out["unmatched"] = judge_.unmatched();
    out["true_returns"] = judge_.true_returns();
    out["reprojection_px"] = spread(all.error_px);
    for (std::size_t i = 0; i < judge_.by_lens().size(); ++i)
      if (judge_.by_lens()[i].error_px.count())
        out["reprojection_px_by_lens"][std::to_string(i)] = judge_.by_lens()[i].error_px.rms();
    out["place_error_m"] = spread(all.place_error_m);
    out["colour_difference"] = spread(all.colour_difference);
    out["exposure_time_error_us"] = {{"rms", exposure_error_us_.rms()},
                                     {"max", exposure_error_us_.max()},
                                     {"exposures", exposure_error_us_.count()}};
    return out;
  }
  double rms_px() const { return judge_.all().error_px.count() ? judge_.all().error_px.rms() : std::nan(""); }

 private:
  static std::int64_t distance(const sim::TrueExposure& truth, const Exposure& exposure) {
    return std::abs(truth.exposure_mid_gps_ns - count_ns(exposure.exposure_mid));
  }

  sim::Judge& judge_;
  const bool is_panorama_;
  std::map<std::uint32_t, std::uint32_t> number_of_;
  sim::Spread exposure_error_us_;
  std::uint64_t points_ = 0, coloured_ = 0;
};

int verify(const VerifyOptions& options) {
  ProgressBar silent(false);
  auto source = DriveSource::open(options.drive, silent, options.method);
  if (!source.ok()) {
    log_error(source.error().message);
    return opening_status(source.error());
  }
  auto judge = sim::Judge::open(*source->scenario, source->drive->cache_dir + "/truth.bin", {});
  if (!judge.ok()) {
    log_error(judge.error().message);
    return kInputUnreadable;
  }
  auto trajectory = open_trajectory(options.trajectory, options.drive, silent, options.method);
  if (!trajectory.ok()) {
    log_error(trajectory.error().message);
    return opening_status(trajectory.error());
  }
  Judging sink(*judge, source->rig.colouring.method == fusion::ColourMethod::Panorama);
  runtime::Pipeline pipeline(source->rig, 2, sink, trajectory->get());
  const Status fed = source->feed(silent, [&](const Packet& packet) {
    pipeline.process(packet);
    return true;
  });
  pipeline.flush();
  const auto json = sink.json();
  if (options.json) {
    std::fputs((json.dump(2) + "\n").c_str(), stdout);
  } else {
    if (*trajectory) std::fputs((*trajectory)->comparison().text().c_str(), stdout);
    std::fputs(
        fmt::format(
            "{:9} points, {} coloured, {} judged, {} without truth\n"
            "reprojection  {:.4f} px rms of an 8000 x 4000 panorama ({:.4f} median, {:.4f} p95, {:.3f} largest)\n"
            "place         {:.2f} mm rms\n"
            "exposure time {:.2f} us rms, {:.2f} us largest, of {} exposures\n",
            json["points"].get<std::uint64_t>(), json["coloured"].get<std::uint64_t>(),
            json["judged"].get<std::uint64_t>(), json["unmatched"].get<std::uint64_t>(),
            json["reprojection_px"]["rms"].get<double>(), json["reprojection_px"]["median"].get<double>(),
            json["reprojection_px"]["p95"].get<double>(), json["reprojection_px"]["max"].get<double>(),
            json["place_error_m"]["rms"].get<double>() * 1e3, json["exposure_time_error_us"]["rms"].get<double>(),
            json["exposure_time_error_us"]["max"].get<double>(),
            json["exposure_time_error_us"]["exposures"].get<std::uint64_t>())
            .c_str(),
        stdout);
  }
  if (!fed.ok()) {
    log_error(fed.error().message);
    return kInputUnreadable;
  }
  if (json["judged"].get<std::uint64_t>() == 0) return kNothingCame;
  return options.max_rms_px > 0 && !(sink.rms_px() <= options.max_rms_px) ? kNotAsExpected : kDone;
}

}  // namespace

void add_verify(Command& all) {
  auto options = std::make_shared<VerifyOptions>();
  Command command = all.command(kVerify.word, kVerify.help);
  options->drive.declare(
      command, {.recording = "RECORDING",
                .recording_help = "drive.mcap of a capture of the scenario; default: the scenario's own bytes, without "
                                  "the effects of real time",
                .rig_help = "another rig instead of the recorded one or of the scenario's perfect calibration",
                .needs_scenario = true});
  options->trajectory.declare(command);
  command.setting("--method", options->method, "without RECORDING: lens or panorama", {"lens", "panorama"});
  command.option("--max-rms-px", options->max_rms_px, "exit status 6 if the root mean square is larger");
  command.flag("--json", options->json, "print JSON, for programs");
  command.footer(
      "Example: hueline verify out/drive --scenario config/scenarios/street.yaml --sim out/sim\n"
      "Exit status: 0; 3 if an input cannot be read; 5 if no point could be judged; 6 if --max-rms-px is exceeded.\n"
      "More: docs/accuracy.md");
  command.runs([options] { return verify(*options); });
}

}  // namespace hueline::apps
