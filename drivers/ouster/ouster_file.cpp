#include "drivers/ouster/ouster_file.hpp"

#include <span>

#include "core/input_file.hpp"
#include "drivers/ouster/ouster_metadata.hpp"

namespace hueline::drivers {

Result<std::string> read_ouster_metadata_file(const std::string& path) {
  constexpr std::uint64_t kMostBytes = 4'000'000;
  return read_input(path, kMostBytes, "the metadata of an Ouster");
}

Result<std::vector<std::byte>> describe_ouster(const std::string& path) {
  const auto text = read_ouster_metadata_file(path);
  if (!text.ok()) return text.error();
  if (const auto metadata = parse_ouster_metadata(*text); !metadata.ok())
    return Error{metadata.error().code, path + ": " + metadata.error().message};
  const auto bytes = std::as_bytes(std::span(*text));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

}  // namespace hueline::drivers
