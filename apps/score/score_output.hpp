#pragma once

#include <filesystem>
#include <vector>

#include "core/result.hpp"
#include "score/page.hpp"

namespace hueline::apps {

/// Creates `dir` and writes score.json, score_notes.json, score.md (the table) and score.html (with embedded pictures)
/// into it. Errors: Io.
Status write_score(const std::filesystem::path& dir, const score::Sheet& sheet, const score::RunNotes& notes,
                   const std::vector<score::Change>& changes);

}  // namespace hueline::apps
