#include "config/sheet.hpp"

#include <set>

#include "config/section.hpp"
#include "config/shipped.hpp"

namespace hueline::config {

Sheet load_sheet(const std::string& name) {
  const std::filesystem::path file = configuration_named(name, "sheets");
  Section root = Section::load_file(file.string());
  Sheet out;
  std::set<std::string> names;
  for (const std::string& text : root.texts("scenarios")) {
    out.scenarios.push_back((file.parent_path() / text).lexically_normal());
    const std::string stem = out.scenarios.back().stem().string();
    if (!names.insert(stem).second) root.refuse("scenarios", "names two files " + stem + "; allowed: each name once");
  }
  out.ray_returns =
      static_cast<std::size_t>(root.integer("ray_returns", {100, 1e7}, static_cast<std::int64_t>(out.ray_returns)));
  root.finish();
  if (out.scenarios.empty()) root.refuse("scenarios", "is an empty list; allowed: one scenario or more");
  return out;
}

}  // namespace hueline::config
