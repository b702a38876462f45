#include "sim/surroundings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "core/input_file.hpp"
#include "sim/jpeg_handle.hpp"

namespace hueline::sim {
namespace {

constexpr int kMostColumns = 32768;
constexpr std::uint64_t kMostBytes = 500'000'000;
constexpr std::size_t kNarrowest = 16;  // width of the smallest level

std::uint64_t hash_of(const std::vector<unsigned char>& bytes) {
  std::uint64_t hash = 0xCBF29CE484222325ull;  // FNV-1a
  for (const unsigned char byte : bytes) hash = (hash ^ byte) * 0x100000001B3ull;
  return hash;
}

float linear(std::uint8_t srgb) {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> out{};
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double v = static_cast<double>(i) / 255;
      out[i] = static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
    }
    return out;
  }();
  return table[srgb];
}

}  // namespace

Result<std::shared_ptr<const Surroundings>> Surroundings::load(const std::filesystem::path& file,
                                                               double centre_azimuth_deg) {
  const auto bytes = read_input(file, kMostBytes, "a photograph");
  if (!bytes.ok())
    return Error{bytes.error().code, fmt::format("{} cannot be read: {}", file.string(), bytes.error().message)};
  const std::vector<unsigned char> jpeg(bytes->begin(), bytes->end());
  const JpegHandle decoder(tjInitDecompress());
  if (!decoder) return Error{ErrorCode::Exhausted, "no memory for a JPEG decoder"};
  int width = 0, height = 0, subsampling = 0, space = 0;
  if (tjDecompressHeader3(decoder.get(), jpeg.data(), jpeg.size(), &width, &height, &subsampling, &space) != 0)
    return Error{ErrorCode::Malformed, fmt::format("{} is no JPEG: {}", file.string(), tjGetErrorStr2(decoder.get()))};
  if (width != 2 * height || width > kMostColumns || static_cast<std::size_t>(width) < kNarrowest)
    return Error{
        ErrorCode::Malformed,
        fmt::format("{} has {} x {} pixels; an equirectangular panorama is twice as wide as high, {} to {} columns",
                    file.string(), width, height, kNarrowest, kMostColumns)};
  Level first;
  first.width = static_cast<std::size_t>(width);
  first.height = static_cast<std::size_t>(height);
  first.rgb.resize(first.width * first.height * 3);
  // The accurate transform gives the same bytes whatever instructions the machine has.
  if (tjDecompress2(decoder.get(), jpeg.data(), jpeg.size(), first.rgb.data(), width, 0, height, TJPF_RGB,
                    TJFLAG_ACCURATEDCT) != 0)
    return Error{ErrorCode::Malformed, fmt::format("{}: {}", file.string(), tjGetErrorStr2(decoder.get()))};
  std::shared_ptr<Surroundings> out(new Surroundings);
  out->levels_.push_back(std::move(first));
  while (out->levels_.back().width >= 2 * kNarrowest) out->levels_.push_back(halved(out->levels_.back()));
  out->centre_azimuth_ = centre_azimuth_deg * std::numbers::pi / 180;
  out->identity_ = fmt::format("{:016x}@{:.17g}", hash_of(jpeg), centre_azimuth_deg);
  return std::shared_ptr<const Surroundings>(std::move(out));
}

Surroundings::Level Surroundings::halved(const Level& level) {
  Level out;
  out.width = level.width / 2;
  out.height = level.height / 2;
  out.rgb.resize(out.width * out.height * 3);
  for (std::size_t y = 0; y < out.height; ++y)
    for (std::size_t x = 0; x < out.width; ++x)
      for (std::size_t c = 0; c < 3; ++c) {
        const auto at = [&](std::size_t column, std::size_t row) {
          return int{level.rgb[((2 * y + row) * level.width + 2 * x + column) * 3 + c]};
        };
        out.rgb[(y * out.width + x) * 3 + c] =
            static_cast<std::uint8_t>((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4);
      }
  return out;
}

Radiance Surroundings::at(Vec3 d, float cone) const {
  constexpr double kTurn = 2 * std::numbers::pi;
  const double column_rad = kTurn / static_cast<double>(levels_.front().width);
  const int wanted = cone > column_rad ? static_cast<int>(std::lround(std::log2(cone / column_rad))) : 0;
  const Level& level = levels_[static_cast<std::size_t>(std::min(wanted, static_cast<int>(levels_.size()) - 1))];
  const double turn = (std::atan2(d.x, d.y) - centre_azimuth_) / kTurn + 0.5;
  const double x = (turn - std::floor(turn)) * static_cast<double>(level.width) - 0.5;
  const double y = std::clamp(
      (0.5 - std::asin(std::clamp(d.z, -1.0, 1.0)) / std::numbers::pi) * static_cast<double>(level.height) - 0.5, 0.0,
      static_cast<double>(level.height - 1));
  const double left = std::floor(x), top = std::floor(y);
  const auto fx = static_cast<float>(x - left), fy = static_cast<float>(y - top);
  const std::size_t x0 = (static_cast<std::size_t>(left + static_cast<double>(level.width))) % level.width,
                    x1 = (x0 + 1) % level.width;
  const auto y0 = static_cast<std::size_t>(top), y1 = std::min(y0 + 1, level.height - 1);
  const auto mixed = [&](std::size_t c) {
    const auto value = [&](std::size_t column, std::size_t row) {
      return linear(level.rgb[(row * level.width + column) * 3 + c]);
    };
    return (1 - fy) * ((1 - fx) * value(x0, y0) + fx * value(x1, y0)) +
           fy * ((1 - fx) * value(x0, y1) + fx * value(x1, y1));
  };
  return {mixed(0), mixed(1), mixed(2)};
}

}  // namespace hueline::sim
