#include "apps/fleet/catalogue_table.hpp"

#include <array>
#include <optional>

#include "core/printable.hpp"

namespace hueline::apps {
namespace {

TableValue value_of(const std::string& text) { return text.empty() ? TableValue() : TableValue(printable(text)); }
template <class Number>
TableValue value_of(const std::optional<Number>& number) {
  return number ? TableValue(*number) : TableValue();
}

/// A column of the drives, and which of a drive's values is in it.
struct DriveColumn {
  TableColumn column;
  TableValue (*value)(const CatalogueEntry& entry);
};
template <auto member>
TableValue take(const CatalogueEntry& entry) {
  return value_of(entry.*member);
}
/// Takes a figure of the watch over the head.
template <class Figure>
TableValue watched(const CatalogueEntry& entry, Figure figure) {
  return entry.watch ? TableValue(figure(*entry.watch)) : TableValue();
}
template <std::size_t axis>
TableValue turned(const CatalogueEntry& entry) {
  return watched(entry, [](const CatalogueWatch& watch) { return watch.turn_deg[axis]; });
}
template <auto member>
TableValue watch_figure(const CatalogueEntry& entry) {
  return watched(entry, [](const CatalogueWatch& watch) { return watch.*member; });
}
using Entry = CatalogueEntry;
using Watch = CatalogueWatch;
constexpr std::array kDriveColumns{
    DriveColumn{{"name", ColumnType::Text}, take<&Entry::name>},
    DriveColumn{{"status", ColumnType::Text}, take<&Entry::status>},
    DriveColumn{{"verdict", ColumnType::Text}, take<&Entry::verdict>},
    DriveColumn{{"begin_utc", ColumnType::Time}, take<&Entry::begin>},
    DriveColumn{{"end_utc", ColumnType::Time}, take<&Entry::end>},
    DriveColumn{{"duration_s", ColumnType::Real}, take<&Entry::duration_s>},
    DriveColumn{{"path_m", ColumnType::Real}, take<&Entry::path_m>},
    DriveColumn{{"points", ColumnType::Integer}, take<&Entry::points>},
    DriveColumn{{"coloured_share", ColumnType::Real}, take<&Entry::coloured_share>},
    DriveColumn{{"recording_bytes", ColumnType::Integer}, take<&Entry::recording_bytes>},
    DriveColumn{{"fusion_s", ColumnType::Real}, take<&Entry::fusion_s>},
    DriveColumn{{"head_turn_x_deg", ColumnType::Real}, turned<0>},
    DriveColumn{{"head_turn_y_deg", ColumnType::Real}, turned<1>},
    DriveColumn{{"head_turn_z_deg", ColumnType::Real}, turned<2>},
    DriveColumn{{"head_turn_sigma_deg", ColumnType::Real}, watch_figure<&Watch::turn_sigma_deg>},
    DriveColumn{{"images_late_ms", ColumnType::Real}, watch_figure<&Watch::late_ms>},
    DriveColumn{{"images_late_sigma_ms", ColumnType::Real}, watch_figure<&Watch::late_sigma_ms>},
    DriveColumn{{"rig", ColumnType::Text}, take<&Entry::rig>},
    DriveColumn{{"rig_sha256", ColumnType::Text}, take<&Entry::rig_sha256>},
    DriveColumn{{"trajectory_sha256", ColumnType::Text}, take<&Entry::trajectory_sha256>},
    DriveColumn{{"program", ColumnType::Text}, take<&Entry::program>},
    DriveColumn{{"recording", ColumnType::Text}, take<&Entry::recording>},
    DriveColumn{{"results", ColumnType::Text}, take<&Entry::results>},
    DriveColumn{{"text", ColumnType::Text}, take<&Entry::text>},
};

}  // namespace

const Table& drives_table() {
  static const Table table = [] {
    Table out{"drives", "drives of the fleet, by the places of the POS", {}};
    for (const DriveColumn& one : kDriveColumns) out.columns.push_back(one.column);
    return out;
  }();
  return table;
}

const Table& products_table() {
  static const Table table{"products",
                           "files of the drives' results, with their SHA-256",
                           {{"drive_fid", ColumnType::Integer},
                            {"file", ColumnType::Text},
                            {"bytes", ColumnType::Integer},
                            {"sha256", ColumnType::Text}}};
  return table;
}

std::vector<TableValue> drive_row(const CatalogueEntry& entry) {
  std::vector<TableValue> out;
  for (const DriveColumn& one : kDriveColumns) out.push_back(one.value(entry));
  return out;
}

std::vector<TableValue> product_row(std::int64_t drive, const std::string& file, const FleetProduct& product) {
  return {drive, value_of(file), static_cast<std::int64_t>(product.bytes), value_of(product.sha256)};
}

}  // namespace hueline::apps
