#include "survey/object_picks.hpp"

#include <utility>

#include <fmt/format.h>

#include "core/csv_table.hpp"

namespace hueline::survey {

Result<std::vector<ObjectPick>> parse_object_picks(const std::string& text, const std::string& file) {
  const auto table = CsvTable::parse(
      text, file, {.needed = {"exposure", "u_px", "v_px"}, .allowed = {"name", "lens"}, .units = {}, .advice = {}});
  if (!table.ok()) return table.error();
  std::vector<ObjectPick> out;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    ObjectPick pick;
    pick.name = table->has("name") ? table->text(row, "name") : fmt::format("line {}", table->line(row));
    pick.lens = table->text(row, "lens");
    const auto exposure = table->whole_number(row, "exposure");
    if (!exposure.ok()) return exposure.error();
    pick.exposure = *exposure;
    const auto u = table->number(row, "u_px"), v = table->number(row, "v_px");
    if (!u.ok() || !v.ok()) return u.ok() ? v.error() : u.error();
    pick.pixel = {*u, *v};
    out.push_back(std::move(pick));
  }
  return out;
}

}  // namespace hueline::survey
