#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "score/figures.hpp"

namespace hueline::score {

/// {scenario: {metric: value}}, null where there is none; scenarios and metrics in the sheet's order. Only figures that
/// are the same on every run and the two of the clock on the wall; why a value is null is in notes.
std::string score_json(const Sheet& sheet);

/// Beside the figures: the command, what was measured on this machine, why a value is null, what each metric means.
struct RunNotes {
  std::string command, revision, machine;
  bool is_deterministic = true;
  std::string determinism;  ///< what was compared, in a sentence
  double wall_s = 0;
};
std::string notes_json(const Sheet& sheet, const RunNotes& notes);

/// Figures of a score.json. Errors: Io, Malformed.
Result<Sheet> read_score_json(const std::filesystem::path& path);

}  // namespace hueline::score
