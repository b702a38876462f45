#include "config/sheet.hpp"

#include <set>

#include "config/section.hpp"

namespace hueline::config {

std::vector<std::filesystem::path> load_sheet(const std::string& name) {
  const bool is_word = name.find_first_of("./") == std::string::npos;
  const std::filesystem::path file = is_word ? "config/sheets/" + name + ".yaml" : name;
  Section root = Section::load_file(file.string());
  std::vector<std::filesystem::path> out;
  std::set<std::string> names;
  for (const std::string& text : root.texts("scenarios")) {
    out.push_back((file.parent_path() / text).lexically_normal());
    if (!names.insert(out.back().stem().string()).second) root.refuse("scenarios", "two files named " + out.back().stem().string());
  }
  root.finish();
  if (out.empty()) root.refuse("scenarios", "a sheet has at least one scenario");
  return out;
}

}  // namespace hueline::config
