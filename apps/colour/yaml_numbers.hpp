#pragma once

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <initializer_list>
#include <string>

#include "apps/colour/published_lens.hpp"

/// Takes numbers from the YAML of other programs. What is no number throws YAML::RepresentationException, with its
/// line.
namespace hueline::apps {

/// Reads a number.
template <class Number>
Number number_of(const YAML::Node& node) {
  Number value{};
  if (!YAML::convert<Number>::decode(node, value))
    throw YAML::RepresentationException(node.Mark(),
                                        node.IsScalar() ? fmt::format("'{}' is no number that fits here", node.Scalar())
                                                        : std::string("a number is expected here"));
  return value;
}

/// Reads the numbers of a node: a list, or a matrix with rows, cols and data.
Numbers numbers_of(const YAML::Node& node, int depth = kDeepest);

/// Reads a number of pixels; 0 if the node is not there.
std::uint32_t pixels(const YAML::Node& node);

/// Returns the first of these keys that the mapping has; empty if it has none.
std::string first_key(const YAML::Node& root, std::initializer_list<const char*> keys);

}  // namespace hueline::apps
