#include "storage/e57_description.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <pugixml.hpp>
#include <utility>
#include <vector>

#include "core/number_word.hpp"
#include "storage/pcd_header.hpp"

namespace hueline::storage {
namespace {

constexpr int kMostNested = 64;  // elements

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
}

/// The elements in an element, without the text between them.
std::vector<pugi::xml_node> elements_in(const pugi::xml_node& parent) {
  std::vector<pugi::xml_node> out;
  for (const pugi::xml_node& child : parent.children())
    if (child.type() == pugi::node_element) out.push_back(child);
  return out;
}

/// Returns a number of the description: where the standard leaves it out it is `otherwise`. Nothing if it is none.
template <class T>
std::optional<T> number_in(std::string_view text, T otherwise) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  return text.empty() ? std::optional(otherwise) : parse_number<T>(text);
}

/// Returns the text of a child: all pieces of it, because a writer parts what would end a CDATA section.
std::string child_text(const pugi::xml_node& parent, const char* child) {
  std::string out;
  for (const pugi::xml_node& piece : parent.child(child).children())
    if (piece.type() == pugi::node_pcdata || piece.type() == pugi::node_cdata) out += piece.value();
  return std::string(trimmed(out));
}

/// Returns the number in a child: 0 if it is missing, and NaN if it is none.
double number_of(const pugi::xml_node& parent, const char* child) {
  return number_in<double>(child_text(parent, child), 0).value_or(std::numeric_limits<double>::quiet_NaN());
}

/// Reads the type of a field. Error: Malformed, Unsupported, with what is wrong.
Result<E57Column> column_from(const pugi::xml_node& field) {
  E57Column out;
  out.name = field.name();
  const std::string_view type = field.attribute("type").value();
  const auto wrong = [&](const char* what) {
    return Error{ErrorCode::Malformed, fmt::format("its field {} has {}", field.name(), what)};
  };
  if (type == "Float") {
    const bool is_single = std::string_view(field.attribute("precision").value()) == "single";
    out.kind = is_single ? E57Column::Kind::Float32 : E57Column::Kind::Float64;
    out.bits = is_single ? 32 : 64;
    return out;
  }
  if (type != "Integer" && type != "ScaledInteger")
    return Error{ErrorCode::Unsupported,
                 fmt::format("its field {} is of type {}; numbers are read", field.name(), type)};
  using Limits = std::numeric_limits<std::int64_t>;
  const auto minimum = number_in<std::int64_t>(field.attribute("minimum").value(), Limits::min());
  const auto maximum = number_in<std::int64_t>(field.attribute("maximum").value(), Limits::max());
  if (!minimum || !maximum || *minimum > *maximum) return wrong("no least and largest integer");
  out.kind = E57Column::Kind::Integer;
  out.minimum = *minimum;
  out.maximum = *maximum;
  out.bits = static_cast<unsigned>(
      std::bit_width(static_cast<std::uint64_t>(*maximum) - static_cast<std::uint64_t>(*minimum)));
  if (type == "Integer") return out;
  const auto scale = number_in<double>(field.attribute("scale").value(), 1);
  const auto offset = number_in<double>(field.attribute("offset").value(), 0);
  if (!scale || !offset) return wrong("no scale and offset");
  out.scale = *scale;
  out.offset = *offset;
  return out;
}

Transform<E57World, Scanner> pose_from(const pugi::xml_node& pose) {
  Transform<E57World, Scanner> out;
  if (!pose) return out;
  const pugi::xml_node place = pose.child("translation");
  out.translation = {number_of(place, "x"), number_of(place, "y"), number_of(place, "z")};
  if (const pugi::xml_node turn = pose.child("rotation")) {
    const Eigen::Quaterniond q(number_of(turn, "w"), number_of(turn, "x"), number_of(turn, "y"), number_of(turn, "z"));
    if (q.norm() != 0) out.rotation = q.normalized();
  }
  return out;
}

/// Reads what the description says of a scan.
Result<E57Scan> scan_from(const pugi::xml_node& data) {
  E57Scan out;
  out.name = child_text(data, "name");
  for (const char* part : {"sensorVendor", "sensorModel", "sensorSerialNumber"})
    if (const std::string word = child_text(data, part); !word.empty())
      out.sensor += (out.sensor.empty() ? "" : " ") + word;
  out.T_world_scanner = pose_from(data.child("pose"));
  if (!out.T_world_scanner.translation.allFinite() || !out.T_world_scanner.rotation.coeffs().allFinite())
    return Error{ErrorCode::Malformed, "its pose has something that is no finite number"};
  if (const pugi::xml_node start = data.child("acquisitionStart")) {
    constexpr double kMostSeconds = 9e9;  // what nanoseconds of 64 bits hold
    const double gps_s = number_of(start, "dateTimeValue");
    if (gps_s > 0 && gps_s < kMostSeconds) out.begin = gps_time_ns(std::llround(gps_s * 1e9));
  }
  const pugi::xml_node points = data.child("points");
  if (!points) return out;
  const auto count = number_in<std::uint64_t>(points.attribute("recordCount").value(), 0);
  const auto section = number_in<std::uint64_t>(points.attribute("fileOffset").value(), 0);
  const pugi::xml_node prototype = points.child("prototype");
  if (!count || !section || !prototype)
    return Error{ErrorCode::Malformed, "it does not say where its points are, how many, and of which fields"};
  out.points = *count;
  out.section = *section;
  const std::vector<pugi::xml_node> fields = elements_in(prototype);
  if (fields.size() > kMostPcdColumns)
    return Error{ErrorCode::Unsupported,
                 fmt::format("its points have {} fields; at most {} are read", fields.size(), kMostPcdColumns)};
  bool has_bits = false;
  for (const pugi::xml_node& field : fields) {
    auto column = column_from(field);
    if (!column.ok()) return column.error();
    has_bits = has_bits || column->bits > 0;
    out.columns.push_back(std::move(*column));
  }
  if (out.points > 0 && !has_bits)
    return Error{ErrorCode::Malformed,
                 "all its points are the same by its description, which has no field that varies"};
  return out;
}

/// Stops at what is nested too deep.
struct DepthLimit : pugi::xml_tree_walker {
  bool for_each(pugi::xml_node& /*node*/) override { return depth() < kMostNested; }
};

}  // namespace

std::optional<std::size_t> E57Scan::column(std::string_view wanted) const {
  const auto found = std::ranges::find(columns, wanted, &E57Column::name);
  return found == columns.end() ? std::nullopt : std::optional(static_cast<std::size_t>(found - columns.begin()));
}

Result<E57Description> decode_e57_description(std::string& xml, const std::string& name) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer_inplace(xml.data(), xml.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed)
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: at byte {} its description is no XML ({}): write the file again", name, parsed.offset,
                             parsed.description())};
  DepthLimit limit;
  if (!document.traverse(limit))
    return Error{ErrorCode::Unsupported, fmt::format("{}: its XML is nested more than {} deep", name, kMostNested)};

  E57Description out;
  const pugi::xml_node root = document.document_element();
  out.crs = child_text(root, "coordinateMetadata");
  out.images = elements_in(root.child("images2D")).size();
  for (const pugi::xml_node& data : elements_in(root.child("data3D"))) {
    auto scan = scan_from(data);
    if (!scan.ok())
      return Error{scan.error().code, fmt::format("{}: scan {}: {}", name, out.scans.size(), scan.error().message)};
    out.scans.push_back(std::move(*scan));
  }
  return out;
}

}  // namespace hueline::storage
