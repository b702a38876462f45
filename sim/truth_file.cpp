#include "sim/truth_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hueline::sim {
namespace {
constexpr double kUnit = 1e-6;  // m
constexpr float kLightUnit = 1.0f / 16384;
constexpr int kMostFiner = 10;  // binary digits
constexpr std::size_t kReturnSize = 46;
constexpr unsigned char kIsMoving = 1;

void put_place(std::vector<unsigned char>& out, double e, double n, double u, Vec3 from) {
  for (const double x : {e - from.x, n - from.y, u - from.z}) {
    const auto um = static_cast<std::int32_t>(std::llround(x / kUnit));
    const auto* p = reinterpret_cast<const unsigned char*>(&um);
    out.insert(out.end(), p, p + 4);
  }
}
/// Returns how many binary digits finer than kLightUnit all three numbers of a light can be.
int finer_digits(const std::array<float, 3>& light) {
  const float largest = std::max({light[0], light[1], light[2]}) / kLightUnit;
  int digits = 0;
  while (digits < kMostFiner && std::ldexp(largest, digits + 1) < 65535.0f) ++digits;
  return digits;
}

}  // namespace

TruthWriter::TruthWriter(const std::string& path, const TruthHeader& h)
    : out_(path), has_fine_light_(h.has_fine_light) {
  out_.bytes(kTruthMagic, 8);
  out_.number(h.origin_latitude_rad);
  out_.number(h.origin_longitude_rad);
  out_.number(h.origin_height_m);
  out_.text(h.scenario);
  out_.number(static_cast<std::uint32_t>(h.surfaces.size()));
  for (const auto& s : h.surfaces) out_.text(s);
  out_.number(static_cast<std::uint32_t>(h.targets.size()));
  for (const SphereTarget& t : h.targets) {
    out_.number(t.surface);
    for (const double x : {t.centre.x, t.centre.y, t.centre.z, t.radius_m}) out_.number(x);
  }
  const std::size_t lenses = h.exposures.empty() ? 0 : h.exposures.front().lens_gain.size();
  out_.number(static_cast<std::uint32_t>(lenses));
  out_.number(static_cast<std::uint32_t>(h.exposures.size()));
  for (const TrueExposure& e : h.exposures) {
    out_.number(e.number);
    out_.number(e.exposure_mid_gps_ns);
    for (const double x : e.R_enu_head) out_.number(x);
    for (const double x : e.p_enu_head) out_.number(x);
    for (std::size_t i = 0; i < lenses; ++i) out_.number(e.lens_gain[i]);
  }
}

void TruthWriter::packet(GpsNs first, Vec3 scanner, std::span<const TrueReturn> returns) {
  out_.number(first);
  for (const double x : {scanner.x, scanner.y, scanner.z}) out_.number(x);
  out_.number(static_cast<std::uint32_t>(returns.size()));
  std::vector<unsigned char> block;
  block.reserve(kReturnSize * returns.size());
  for (const TrueReturn& r : returns) {
    const auto after = static_cast<std::uint32_t>(r.fired_gps_ns - first);
    const auto* p = reinterpret_cast<const unsigned char*>(&after);
    block.insert(block.end(), p, p + 4);
    for (const std::uint16_t x : {r.channel, r.surface}) {
      block.push_back(static_cast<unsigned char>(x & 0xFF));
      block.push_back(static_cast<unsigned char>(x >> 8));
    }
    put_place(block, r.beam_east, r.beam_north, r.beam_up, scanner);
    put_place(block, r.east, r.north, r.up, scanner);
    block.insert(block.end(), {r.red, r.green, r.blue, r.is_moving ? kIsMoving : static_cast<unsigned char>(0)});
    const int finer = has_fine_light_ ? finer_digits(r.light) : 0;
    block.insert(block.end(), {r.albedo[0], r.albedo[1], r.albedo[2], static_cast<unsigned char>(finer)});
    for (const float x : r.light) {
      const float exact = std::ldexp(x / kLightUnit, finer);
      const auto units = static_cast<std::uint16_t>(std::clamp(exact + 0.5f, 0.0f, 65535.0f));
      block.push_back(static_cast<unsigned char>(units & 0xFF));
      block.push_back(static_cast<unsigned char>(units >> 8));
    }
  }
  out_.bytes(block.data(), block.size());
}

Result<TruthReader> TruthReader::open(const std::string& path) {
  TruthReader reader(path);
  ByteReader& in = reader.in_;
  TruthHeader& h = reader.header_;
  char magic[8] = {};
  in.bytes(magic, 8);
  if (in.status().ok() && std::memcmp(magic, kTruthMagic, 8) != 0)
    in.fail(fmt::format("is not a truth file of this version: it does not begin with {}", kTruthMagic));
  h.origin_latitude_rad = in.number<double>();
  h.origin_longitude_rad = in.number<double>();
  h.origin_height_m = in.number<double>();
  h.scenario = in.text();
  const auto surfaces = in.number<std::uint32_t>();
  for (std::uint32_t i = 0; in.fits(surfaces - i, 4) && i < surfaces; ++i) h.surfaces.push_back(in.text());
  const auto targets = in.number<std::uint32_t>();
  for (std::uint32_t i = 0; in.fits(targets - i, 34) && i < targets; ++i) {
    SphereTarget t;
    t.surface = in.number<std::uint16_t>();
    for (double* x : {&t.centre.x, &t.centre.y, &t.centre.z, &t.radius_m}) *x = in.number<double>();
    h.targets.push_back(t);
  }
  const auto lenses = in.number<std::uint32_t>();
  const auto exposures = in.number<std::uint32_t>();
  if (lenses > 255) in.fail("says that the head has more than 255 lenses");
  for (std::uint32_t i = 0; in.fits(exposures - i, 108 + 4 * std::uint64_t{lenses}) && i < exposures; ++i) {
    TrueExposure e;
    e.number = in.number<std::uint32_t>();
    e.exposure_mid_gps_ns = in.number<std::int64_t>();
    for (double& x : e.R_enu_head) x = in.number<double>();
    for (double& x : e.p_enu_head) x = in.number<double>();
    e.lens_gain.resize(lenses);
    for (float& x : e.lens_gain) x = in.number<float>();
    h.exposures.push_back(e);
  }
  if (!in.status().ok()) return in.status().error();
  return reader;
}

Result<std::vector<TrueReturn>> TruthReader::next_packet() {
  if (in_.status().ok() && in_.left() == 0) return Error{ErrorCode::EndOfData, "the last packet's truth was read"};
  const auto first = in_.number<std::int64_t>();
  Vec3 scanner;
  scanner.x = in_.number<double>();
  scanner.y = in_.number<double>();
  scanner.z = in_.number<double>();
  const auto count = in_.number<std::uint32_t>();
  if (!in_.fits(count, kReturnSize)) return in_.status().error();
  std::vector<unsigned char> block(kReturnSize * static_cast<std::size_t>(count));
  in_.bytes(block.data(), block.size());
  std::vector<TrueReturn> returns(count);
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned char* p = &block[kReturnSize * i];
    const auto u32 = [&](std::size_t at) {
      std::uint32_t x;
      std::memcpy(&x, p + at, 4);
      return x;
    };
    const auto metres = [&](std::size_t at) { return kUnit * static_cast<double>(static_cast<std::int32_t>(u32(at))); };
    TrueReturn& r = returns[i];
    r.fired_gps_ns = first + u32(0);
    r.channel = static_cast<std::uint16_t>(p[4] | p[5] << 8);
    r.surface = static_cast<std::uint16_t>(p[6] | p[7] << 8);
    r.beam_east = scanner.x + metres(8);
    r.beam_north = scanner.y + metres(12);
    r.beam_up = scanner.z + metres(16);
    r.east = scanner.x + metres(20);
    r.north = scanner.y + metres(24);
    r.up = scanner.z + metres(28);
    r.red = p[32];
    r.green = p[33];
    r.blue = p[34];
    if (p[35] > kIsMoving || p[39] > kMostFiner) in_.fail("has a return with unknown flags");
    r.is_moving = p[35] == kIsMoving;
    for (std::size_t k = 0; k < 3; ++k) {
      r.albedo[k] = p[36 + k];
      r.light[k] = std::ldexp(kLightUnit * static_cast<float>(p[40 + 2 * k] | p[41 + 2 * k] << 8), -p[39]);
    }
  }
  if (!in_.status().ok()) return in_.status().error();
  return returns;
}

}  // namespace hueline::sim
