#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "score/figures.hpp"

namespace hueline::score {

/// Returns {scenario: {metric: value}}, null where there is no value; scenarios and metrics stand in the order of the
/// sheet. It holds only figures that are the same on every run, and the two that are measured by the wall clock. The
/// notes say why a value is null.
std::string score_json(const Sheet& sheet);

/// What stands beside the figures: the command, what was measured on this machine, why a value is null, what each
/// metric means.
struct RunNotes {
  std::string command, revision, machine;
  bool is_deterministic = true;
  std::string determinism;  ///< what was compared, in a sentence
  double wall_s = 0;
};
/// Returns the notes as JSON.
std::string notes_json(const Sheet& sheet, const RunNotes& notes);

/// Reads the figures of a score.json. Errors: Io, Malformed.
Result<Sheet> read_score_json(const std::filesystem::path& path);

}  // namespace hueline::score
