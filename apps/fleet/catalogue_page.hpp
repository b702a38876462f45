#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/fleet/catalogue.hpp"

namespace hueline::apps {

/// Returns the catalogue as one page of HTML without any other file: verdicts side by side, where was driven, what was
/// wrong by cause, what the watch over the head found over time, and what drives cost. `folder` is where the page will
/// be: links to reports are relative to it. The same drives give the same bytes.
std::string catalogue_page(const std::vector<CatalogueEntry>& entries, const std::filesystem::path& folder);

}  // namespace hueline::apps
