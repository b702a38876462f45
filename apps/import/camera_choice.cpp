#include "apps/import/camera_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include "apps/import/camera_lens.hpp"

namespace hueline::apps {
namespace {

using CameraTopics = std::map<std::string, CameraTopic>;

bool can_be_used(const CameraTopic& one) { return one.width > 0; }

/// Returns what the images of one camera have in common: their frame, or without one the folder of their topics.
std::string camera_of(std::string topic, const CameraTopic& one) {
  if (!one.frame.empty()) return one.frame;
  constexpr std::string_view kTransport = "/compressed";  // image_raw/compressed lies beside image_raw
  if (topic.ends_with(kTransport)) topic.resize(topic.size() - kTransport.size());
  return topic.substr(0, topic.rfind('/') + 1);
}

auto worth(const std::string& topic, const CameraTopic& one, std::uint64_t most_images) {
  return std::tuple(!one.is_grey, one.has_lens, 2 * one.images >= most_images, std::uint64_t{one.width} * one.height,
                    !is_rectified(topic), !one.is_compressed, topic.find("raw") != std::string::npos);
}

/// Returns the best topic of each camera, by camera_of().
std::map<std::string, std::string> best_of_each(const CameraTopics& found) {
  std::map<std::string, std::uint64_t> most;
  for (const auto& [name, one] : found)
    if (can_be_used(one)) most[camera_of(name, one)] = std::max(most[camera_of(name, one)], one.images);
  std::map<std::string, std::string> out;
  for (const auto& [name, one] : found) {
    if (!can_be_used(one)) continue;
    const std::string camera = camera_of(name, one);
    // The names come in their order, so the first of equal ones stays.
    const auto [known, is_new] = out.try_emplace(camera, name);
    const std::string& best = known->second;
    if (!is_new && worth(name, one, most[camera]) > worth(best, found.at(best), most[camera])) known->second = name;
  }
  return out;
}

Result<CameraChoice> take_wanted(const CameraTopics& found, const std::vector<std::string>& wanted) {
  CameraChoice out;
  const std::set<std::string> named(wanted.begin(), wanted.end());
  for (const std::string& topic : named) {
    const auto one = found.find(topic);
    const std::string why = one == found.end()          ? "the recording has no images of that topic"
                            : !can_be_used(one->second) ? one->second.why
                                                        : "";
    if (!why.empty()) return Error{ErrorCode::Invalid, fmt::format("--images {}: {}", topic, why)};
    out.topics.push_back(topic);
  }
  for (const auto& [name, one] : found)
    if (!named.contains(name)) out.not_used[name] = can_be_used(one) ? "--images does not name it" : one.why;
  return out;
}

}  // namespace

Result<CameraChoice> choose_cameras(const CameraTopics& found, const std::vector<std::string>& wanted) {
  if (!wanted.empty()) return take_wanted(found, wanted);
  const auto best = best_of_each(found);
  const auto coloured = std::ranges::find_if(best, [&](const auto& one) { return !found.at(one.second).is_grey; });
  CameraChoice out;
  for (const auto& [name, one] : found) {
    std::string& why = out.not_used[name];
    if (!can_be_used(one))
      why = one.why;
    else if (const std::string& other = best.at(camera_of(name, one)); other != name)
      why = fmt::format("{} is of the same camera{}; if they are of two cameras, name both with --images", other,
                        one.frame.empty() ? "" : ", in the frame " + one.frame);
    else if (one.is_grey && coloured != best.end())
      why = fmt::format("its pixels are grey, and {} has colours; --images names what is taken", coloured->second);
    else
      out.topics.push_back(name);
    if (why.empty()) out.not_used.erase(name);
  }
  return out;
}

}  // namespace hueline::apps
