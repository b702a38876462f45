#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.hpp"

namespace hueline::storage {

/// An element of an XML document. Names are as written, with their prefix ("nor:normalX").
struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;
  std::string text;  ///< what stands between the tags, CDATA included, without what children have
  std::vector<XmlElement> children;

  /// Returns the first child of this name, or null.
  const XmlElement* child(std::string_view wanted) const;
  /// Returns the value of an attribute; empty if there is none.
  std::string_view attribute(std::string_view wanted) const;
};

/// Reads an XML 1.0 document in UTF-8 and returns its root. Comments, processing instructions and the declaration of a
/// document type are passed over; entities that such a declaration makes are not known. `name` stands for the file in
/// messages. Errors: Malformed with the byte; Unsupported if elements are nested more than 64 deep.
Result<XmlElement> parse_xml(std::string_view text, const std::string& name);

}  // namespace hueline::storage
