#include "config/drive_products.hpp"

#include <charconv>
#include <optional>
#include <vector>

#include "core/exposure_choice.hpp"

namespace hueline::config {
namespace {

constexpr std::uint32_t kLeastWidth = 64, kMostWidth = 16384;

/// Reads numbers that `separator` divides. Returns nothing unless there are `count` of them.
std::vector<std::uint32_t> numbers(const std::string& text, char separator, std::size_t count) {
  std::vector<std::uint32_t> out;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (;;) {
    std::uint32_t value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc{}) return {};
    out.push_back(value);
    if (next == end) return out.size() == count ? out : std::vector<std::uint32_t>{};
    if (*next != separator) return {};
    at = next + 1;
  }
}

std::optional<std::uint32_t> width_of(const std::string& size) {
  const auto sides = numbers(size, 'x', 2);
  if (sides.empty() || sides[0] != 2 * sides[1] || sides[0] < kLeastWidth || sides[0] > kMostWidth || sides[0] % 4 != 0)
    return {};
  return sides[0];
}

std::optional<std::array<std::uint8_t, 3>> colour_of(const std::string& text) {
  const auto parts = numbers(text, ',', 3);
  std::array<std::uint8_t, 3> out{};
  for (std::size_t c = 0; c < parts.size(); ++c) {
    if (parts[c] > 255) return {};
    out[c] = static_cast<std::uint8_t>(parts[c]);
  }
  return parts.empty() ? std::nullopt : std::optional(out);
}

const TextForm kExposures{"all, every:N, or numbers and ranges such as 3,7,20-30",
                          [](const std::string& text) { return ExposureChoice::parse(text).ok(); }};
const TextForm kSize{
    "WIDTHxHEIGHT such as 8192x4096, whose width is twice the height, from 64 to 16384 and divisible by 4",
    [](const std::string& text) { return width_of(text).has_value(); }, "^[0-9]+x[0-9]+$"};
const TextForm kColour{"red,green,blue, from 0 to 255 each, such as 64,64,64",
                       [](const std::string& text) { return colour_of(text).has_value(); }, "^[0-9]+,[0-9]+,[0-9]+$"};

void visit_exposures(Keys& keys, std::string& exposures) {
  keys.text({"exposures", "",
             "Which exposures: `all`, `every:N` for the first of each N moments, or numbers and ranges such as "
             "`3,7,20-30`."},
            exposures, kExposures);
}

void visit_format(Keys& keys, std::string& format, int& quality) {
  keys.word({"format", "", "Format of the pictures."}, format, {"jpeg", "png"});
  keys.whole({"quality", "", "Quality of JPEG pictures."}, quality, {1, 100});
}

}  // namespace

void PanoramaKeys::visit(Keys& keys) {
  visit_exposures(keys, exposures);
  keys.text({"size", "px", "Width and height, such as `8192x4096`.", "what the lenses resolve"}, size, kSize);
  keys.word({"method", "",
             "Where a lens is sampled: at the distance of the laser points (`depth`), or on the rig's stitching sphere "
             "(`sphere`)."},
            method, {"depth", "sphere"});
  keys.word({"orientation", "",
             "Level with the head's direction in the middle (`heading`), level with north in the middle (`north`), or "
             "the head's own axes (`head`)."},
            orientation, {"heading", "north", "head"});
  keys.word({"blend", "", "How lenses meet: in bands, or abruptly (`none`)."}, blend, {"bands", "none"});
  keys.word({"gains", "", "Brightness of the lenses: made even where they overlap, or as it is (`raw`)."}, gains,
            {"even", "raw"});
  keys.word({"vehicle", "",
             "What the vehicle hides and the hole below: filled from exposures near by (`fill`), hidden (`hide`), or "
             "the vehicle is shown (`show`)."},
            vehicle, {"fill", "hide", "show"});
  keys.text({"fill", "", "Colour of what no lens shows: red,green,blue."}, fill, kColour);
  keys.number({"around_s", "s", "Laser points within this time before and after are used."}, around_s, {0.05, 60});
  visit_format(keys, format, quality);
}

std::uint32_t PanoramaKeys::width_px() const { return width_of(size).value_or(0); }

std::array<std::uint8_t, 3> PanoramaKeys::fill_colour() const {
  return colour_of(fill).value_or(std::array<std::uint8_t, 3>{});
}

void ImageKeys::visit(Keys& keys) {
  visit_exposures(keys, exposures);
  keys.word({"lens", "", "Pixels as `recorded`, or undistorted (`pinhole`)."}, lens, {"recorded", "pinhole"});
  visit_format(keys, format, quality);
}

}  // namespace hueline::config
