#include "drivers/gige/chunk_data.hpp"

#include <fmt/format.h>

#include <charconv>
#include <functional>
#include <map>
#include <string_view>

namespace hueline::drivers {
namespace {

constexpr std::size_t kTail = 8;  // id and length
constexpr std::size_t kMostChunks = 256;

std::uint32_t number_at(std::span<const std::byte> bytes, std::size_t at, std::endian order) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t byte = order == std::endian::big ? i : 3 - i;
    value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + byte]);
  }
  return value;
}

/// Returns what stands between `before` and `after` in a text, without the white space around it; empty if nothing
/// does.
std::string_view between(std::string_view text, std::string_view before, std::string_view after) {
  const std::size_t from = text.find(before);
  if (from == std::string_view::npos) return {};
  text.remove_prefix(from + before.size());
  text = text.substr(0, text.find(after));
  constexpr std::string_view kWhite = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kWhite);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kWhite) - first + 1);
}

}  // namespace

std::vector<Chunk> read_chunks(std::span<const std::byte> payload, std::endian order) {
  std::vector<Chunk> out;
  while (payload.size() >= kTail && out.size() < kMostChunks) {
    const std::size_t tail = payload.size() - kTail;
    const std::uint32_t length = number_at(payload, tail + 4, order);
    if (length > tail) break;
    out.push_back({number_at(payload, tail, order), payload.subspan(tail - length, length)});
    payload = payload.first(tail - length);
  }
  return out;
}

ChunkDescription describe_chunks(const std::string& description) {
  ChunkDescription out;
  std::map<std::string, std::size_t, std::less<>> chunk_of_port;
  // The ports of chunks become parts of the memory: their ids go.
  const std::string_view text = description;
  constexpr std::string_view kPort = "<Port ", kPortEnd = "</Port>";
  std::string without_ids;
  std::size_t at = 0;
  for (std::size_t begin; (begin = text.find(kPort, at)) != std::string_view::npos;) {
    std::size_t end = text.find(kPortEnd, begin);
    const std::size_t next = text.find(kPort, begin + kPort.size()), head_end = text.find('>', begin);
    if (head_end == std::string_view::npos) break;
    // A port without content is <Port .../>.
    const bool is_empty = end == std::string_view::npos || (next != std::string_view::npos && next < end);
    end = is_empty ? head_end + 1 : end + kPortEnd.size();
    const std::string_view port = text.substr(begin, end - begin), id = between(port, "<ChunkID>", "</ChunkID>");
    std::string_view name = between(port, "Name=\"", "\"");
    if (name.empty()) name = between(port, "Name='", "'");
    std::uint32_t number = 0;
    const std::string_view digits = id.starts_with("0x") || id.starts_with("0X") ? id.substr(2) : id;
    const auto [stop, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), number, 16);
    const bool is_chunk =
        !digits.empty() && !name.empty() && problem == std::errc() && stop == digits.data() + digits.size();
    without_ids += text.substr(at, begin - at);
    if (is_chunk) {
      chunk_of_port.emplace(name, out.ids.size());
      out.ids.push_back(number);
      without_ids += fmt::format("<Port Name=\"{}\"></Port>", name);
    } else {
      without_ids += port;
    }
    at = end;
  }
  without_ids += text.substr(at);
  if (out.ids.empty()) return out;
  // GenApi adds all addresses of a register.
  constexpr std::string_view kOfPort = "<pPort>", kOfPortEnd = "</pPort>";
  const std::string_view all = without_ids;
  at = 0;
  for (std::size_t begin; (begin = all.find(kOfPort, at)) != std::string_view::npos;) {
    const std::string_view name = between(all.substr(begin), kOfPort, kOfPortEnd);
    out.text += all.substr(at, begin - at);
    if (const auto found = chunk_of_port.find(name); found != chunk_of_port.end())
      out.text +=
          fmt::format("<Address>{}</Address>", ChunkDescription::kFirst + found->second * ChunkDescription::kApart);
    out.text += kOfPort;
    at = begin + kOfPort.size();
  }
  out.text += all.substr(at);
  return out;
}

}  // namespace hueline::drivers
