#include "config/rig_difference.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <map>
#include <optional>
#include <set>
#include <utility>

#include "config/section.hpp"

namespace hueline::config {
namespace {

using Values = std::map<std::string, std::string>;

/// Returns the values below a node by their paths.
Values values_of(const YAML::Node& root) {
  Values out;
  std::vector<std::pair<std::string, YAML::Node>> open{{"", root}};
  while (!open.empty()) {
    const auto [path, node] = std::move(open.back());
    open.pop_back();
    if (node.IsMap()) {
      for (const auto& entry : node)
        open.emplace_back(path + (path.empty() ? "" : ".") + entry.first.Scalar(), entry.second);
    } else if (node.IsSequence()) {
      for (std::size_t i = 0; i < node.size(); ++i) open.emplace_back(fmt::format("{}[{}]", path, i), node[i]);
    } else {
      out[path] = node.IsScalar() ? node.Scalar() : "";
    }
  }
  return out;
}

std::optional<Values> values_of_sensor(const std::string& rig, const std::string& name) {
  try {
    const YAML::Node sensors = YAML::Load(rig)["sensors"];
    for (const auto& one : sensors)
      if (one.IsMap() && one["name"] && one["name"].IsScalar() && one["name"].Scalar() == name) return values_of(one);
  } catch (const YAML::Exception& e) {
    throw ConfigError(fmt::format("a rig is no YAML: {}", e.what()));
  }
  return {};
}

bool is_equal(const std::string& a, const std::string& b) {
  if (a == b) return true;
  double number_a = 0, number_b = 0;
  return YAML::convert<double>::decode(YAML::Node(a), number_a) &&
         YAML::convert<double>::decode(YAML::Node(b), number_b) && number_a == number_b;
}

}  // namespace

std::vector<KeyDifference> sensor_differences(const std::string& first, const std::string& second,
                                              const std::string& sensor) {
  const auto a = values_of_sensor(first, sensor), b = values_of_sensor(second, sensor);
  std::vector<KeyDifference> out;
  if (!a || !b) return out;
  std::set<std::string> keys;
  for (const Values* values : {&*a, &*b})
    for (const auto& [key, value] : *values) keys.insert(key);
  for (const std::string& key : keys) {
    const auto in_a = a->find(key), in_b = b->find(key);
    if (in_a != a->end() && in_b != b->end() && is_equal(in_a->second, in_b->second)) continue;
    out.push_back({key, in_a != a->end() ? in_a->second : "absent", in_b != b->end() ? in_b->second : "absent"});
  }
  return out;
}

}  // namespace hueline::config
