#pragma once

#include <string>
#include <vector>

#include "score/comparison.hpp"
#include "score/sheet_file.hpp"

namespace hueline::score {

/// Returns the whole sheet as one self-contained HTML page: pictures and charts first, all numbers below.
/// `pictures[i][k]` is the address (a data: URI) of sheet[i].pictures[k]. `changes` are those against an older sheet;
/// they may be empty.
std::string page(const Sheet& sheet, const std::vector<std::vector<std::string>>& pictures, const RunNotes& notes,
                 const std::vector<Change>& changes);

}  // namespace hueline::score
