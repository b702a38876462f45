#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/keys.hpp"

/// What a list of keys tells people and editors: tables for documents, and a JSON schema.
namespace hueline::config {

/// A list of keys, for the tables in documents.
struct KeyDocument {
  std::string name;  ///< name of the list in documents, e.g. "rig"
  std::function<void(Keys&)> visit;
  bool has_paths = false;  ///< whether tables write a key with the mappings around it, e.g. "street.road_width_m"
};
/// Returns the keys of a rig file.
KeyDocument rig_document();

/// Returns the document with its tables of keys written anew. A table stands between two lines of this form:
///
///     <!-- keys NAME PATH -->
///     <!-- end of keys -->
///
/// NAME is the name of one of `lists`. PATH leads to a mapping by the names of keys. Where a word decides which further
/// keys a mapping has, PATH has that word too ("sensors velodyne udp"). Without PATH the table has the keys of the file
/// itself. Further paths, each after a plus sign, add the keys of other mappings. Throws ConfigError, which names the
/// line, if its list or path is unknown.
std::string with_key_tables(const std::string& document, const std::vector<KeyDocument>& lists);

/// Returns a JSON schema (draft-07) of a rig file.
nlohmann::ordered_json rig_schema();

}  // namespace hueline::config
