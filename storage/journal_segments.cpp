#include "storage/journal_segments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "core/input_folder.hpp"
#include "core/number_word.hpp"

namespace hueline::storage {
namespace {

constexpr std::size_t kDigits = 6;

/// Returns runs of numbers as "1-4,7".
std::string written(const std::vector<bool>& removed) {
  std::string out;
  for (std::size_t i = 0; i < removed.size(); ++i) {
    if (!removed[i]) continue;
    std::size_t last = i;
    while (last + 1 < removed.size() && removed[last + 1]) ++last;
    out += fmt::format("{}{}", out.empty() ? "" : ",", i);
    if (last > i) out += fmt::format("-{}", last);
    i = last;
  }
  return out;
}

std::vector<bool> read_runs(std::string_view text) {
  std::vector<bool> out;
  while (!text.empty()) {
    const std::string_view run = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), run.size() + 1));
    const std::size_t dash = run.find('-');
    const auto first = parse_number<std::uint32_t>(run.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : parse_number<std::uint32_t>(run.substr(dash + 1));
    if (!first || !last || *last < *first || *last > kMostSegments) continue;
    if (out.size() <= *last) out.resize(*last + std::size_t{1});
    for (std::size_t i = *first; i <= *last; ++i) out[i] = true;
  }
  return out;
}

}  // namespace

std::filesystem::path segment_path(const std::filesystem::path& first, std::uint32_t number) {
  if (number <= 1) return first;
  return first.parent_path() /
         fmt::format("{}.{:0{}}{}", first.stem().string(), number, kDigits, first.extension().string());
}

Segment first_of(const std::filesystem::path& segment) {
  const std::filesystem::path stem = segment.stem();
  const std::string digits = stem.has_extension() ? stem.extension().string().substr(1) : std::string();
  if (digits.size() != kDigits || digits.find_first_not_of("0123456789") != std::string::npos) return {1, segment};
  const auto number = parse_number<std::uint32_t>(digits);
  if (!number || *number < 2) return {1, segment};
  return {*number, segment.parent_path() / (stem.stem().string() + segment.extension().string())};
}

Result<std::vector<Segment>> find_segments(const std::filesystem::path& named) {
  const Segment first = first_of(named);
  std::vector<Segment> out;
  const auto names = list_folder(named.parent_path());
  if (!names.ok()) return names.error();
  for (const std::string& name : *names) {
    const Segment found = first_of(named.parent_path() / name);
    if (found.path == first.path && found.number >= first.number)
      out.push_back({found.number, segment_path(first.path, found.number)});
  }
  std::ranges::sort(out, {}, &Segment::number);
  const bool is_absent = out.empty() || out.front().number != first.number;
  return is_absent ? std::vector<Segment>{{first.number, named}} : out;
}

SegmentPlace SegmentPlace::of(const JournalHeader& header) {
  const auto text = [&](const char* key) {
    const auto found = header.about.find(key);
    return found == header.about.end() ? std::string() : found->second;
  };
  SegmentPlace out;
  out.recording = text(kSegmentRecording);
  out.number = std::max(1u, parse_number<std::uint32_t>(text(kSegmentNumber)).value_or(1));
  out.follows = parse_number<std::uint64_t>(text(kSegmentFollows));
  out.removed = read_runs(text(kSegmentRemoved));
  out.removed_packets = parse_number<std::uint64_t>(text(kSegmentRemovedPackets)).value_or(0);
  out.removed_bytes = parse_number<std::uint64_t>(text(kSegmentRemovedBytes)).value_or(0);
  return out;
}

void SegmentPlace::put_into(JournalHeader& header) const {
  header.about[kSegmentRecording] = recording;
  header.about[kSegmentNumber] = std::to_string(number);
  if (follows) header.about[kSegmentFollows] = std::to_string(*follows);
  const std::string numbers = written(removed);
  if (numbers.empty()) return;
  header.about[kSegmentRemoved] = numbers;
  header.about[kSegmentRemovedPackets] = std::to_string(removed_packets);
  header.about[kSegmentRemovedBytes] = std::to_string(removed_bytes);
}

RemovedSegments SegmentPlace::removed_so_far() const {
  return {static_cast<std::uint64_t>(std::ranges::count(removed, true)), removed_packets, removed_bytes};
}

}  // namespace hueline::storage
