#include "score/recording_figures.hpp"

#include <fmt/format.h>

namespace hueline::score {

void add_recording_figures(const std::optional<RecordingFacts>& facts, ScenarioScore& score) {
  if (!facts) {
    for (const char* name :
         {"recorded_share", "recovered_share", "recording_end_lost_s", "lost_untold_packets", "replay_same_cloud"})
      score.figures[name] = {{}, "the computer is well: nothing is recorded"};
    return;
  }
  const RecordingFacts& f = *facts;
  score.figures["overtold_units"] = {
      {}, "what the recording lost is told inside it, and shows as gaps in the devices' counts too"};
  const auto share = [](std::uint64_t part, std::uint64_t whole, const char* reason) {
    return whole > 0 ? Figure{static_cast<double>(part) / static_cast<double>(whole), {}} : Figure{{}, reason};
  };
  score.figures["recorded_share"] = share(f.recovered, f.came, "no packet came");
  score.figures["recovered_share"] = share(f.promised - f.promised_missing, f.promised, "nothing was promised");
  score.figures["recording_end_lost_s"] = {f.end_lost_s, {}};
  score.figures["lost_untold_packets"] = {static_cast<double>(f.untold + f.changed), {}};
  score.figures["replay_same_cloud"] = {f.is_same_cloud ? 1.0 : 0.0, {}};
  if (Figure& bytes = score.figures["unexplained_bytes"]; bytes.value)
    *bytes.value += static_cast<double>(f.untold_bytes);
  score.notes.push_back(
      fmt::format("recording: {} packets came, {} found the recorder's queue full ({} are told inside it), {} were "
                  "read back; of {} promised {} are missing; {} changed, {} lost "
                  "untold ({} bytes); {:.3f} s until the end are lost; the replay's cloud is {}; {}",
                  f.came, f.refused, f.told, f.recovered, f.promised, f.promised_missing, f.changed, f.untold,
                  f.untold_bytes, f.end_lost_s,
                  f.is_same_cloud ? "that of the same packets before they were written"
                                  : "ANOTHER than that of the same packets before they were written",
                  f.end));
}

}  // namespace hueline::score
