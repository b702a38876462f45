#pragma once

#include <string>
#include <vector>

#include "score/comparison.hpp"
#include "score/sheet_file.hpp"

namespace hueline::score {

/// The whole sheet as one HTML page that needs nothing else: pictures and drawings first, every number below.
/// `pictures[i][k]` is the address (a data: URI) of sheet[i].pictures[k]. `changes` against an older sheet may be
/// empty.
std::string page(const Sheet& sheet, const std::vector<std::vector<std::string>>& pictures, const RunNotes& notes,
                 const std::vector<Change>& changes);

}  // namespace hueline::score
