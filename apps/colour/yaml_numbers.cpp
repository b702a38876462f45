#include "apps/colour/yaml_numbers.hpp"

namespace hueline::apps {

Numbers numbers_of(const YAML::Node& node, int depth) {
  Numbers out;
  if (depth == 0) return out;
  if (node.IsMap()) return node["data"] ? numbers_of(node["data"], depth - 1) : out;
  for (const auto& one : node) {
    if (one.IsSequence()) {
      const Numbers inner = numbers_of(one, depth - 1);
      out.insert(out.end(), inner.begin(), inner.end());
    } else {
      out.push_back(number_of<double>(one));
    }
  }
  return out;
}

std::uint32_t pixels(const YAML::Node& node) {
  return node && node.IsScalar() ? number_of<std::uint32_t>(node) : std::uint32_t{0};
}

std::string first_key(const YAML::Node& root, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (root[key]) return key;
  return {};
}

}  // namespace hueline::apps
