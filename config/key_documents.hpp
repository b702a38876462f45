#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/keys.hpp"

/// What a list of keys tells people and editors.
namespace hueline::config {

/// A list of keys that documents have tables of.
struct KeyDocument {
  std::string name;  ///< in documents: "rig"
  std::function<void(Keys&)> visit;
  bool has_paths = false;  ///< whether tables name a key with the mappings around it: "street.road_width_m"
};
KeyDocument rig_document();

/// The document with the table of keys between each two lines
///   <!-- keys NAME PATH -->
///   <!-- end of keys -->
/// written anew. NAME is that of one of `lists`. PATH leads to a mapping by names of keys, and of the word that decides
/// which further keys a mapping has ("sensors velodyne udp"); without it the table is of the file itself. " + PATH"
/// adds the keys of another mapping. ConfigError names a line whose list or path is unknown.
std::string with_key_tables(const std::string& document, const std::vector<KeyDocument>& lists);

/// A JSON schema (draft-07) of a rig file.
nlohmann::ordered_json rig_schema();

}  // namespace hueline::config
