#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/byte_file.hpp"
#include "sim/drive.hpp"
#include "sim/scene.hpp"
#include "sim/vec3.hpp"

/// truth.bin, little-endian, no padding:
///   8 bytes "HLTRUTH2" (HLTRUTH1, without gains, targets, albedo, light and flags, is no longer read: render again)
///   f64 latitude, longitude (rad), ellipsoidal height (m) of the scene's origin; places below are in its local level,
///   m text: the scenario, a line "key=value" each        (text: u32 length, UTF-8) u32 number of surfaces, a text each
///   u32 number of sphere targets; each: u16 surface, f64[3] centre, f64 radius (m)
///   u32 number of lenses L; u32 number of exposures; each: u32 number, i64 middle of the exposure (GPS ns), f64[9]
///   R_enu_head row-major,
///     f64[3] p_enu_head, f32[L] gain of each lens
///   then packets until the end of the file; each: i64 first firing (GPS ns), f64[3] place of the scanner then, u32
///   number of returns n,
///     n x 46 bytes: u32 fired, ns after the first firing; u16 channel; u16 surface; i32[3] beam_* and i32[3] true hit,
///     um from the scanner's place; u8 red, green, blue; u8 flags (1: the surface moves by itself); u8[3] albedo; u8 0;
///     u16[3] light in 2^-14
namespace hueline::sim {

struct TruthHeader {
  double origin_latitude_rad = 0, origin_longitude_rad = 0, origin_height_m = 0;
  std::string scenario;
  std::vector<std::string> surfaces;
  std::vector<SphereTarget> targets;
  std::vector<TrueExposure> exposures;
};

constexpr char kTruthMagic[] = "HLTRUTH2";

class TruthWriter {
 public:
  TruthWriter(const std::string& path, const TruthHeader& header);
  void packet(GpsNs first_firing, Vec3 scanner_enu, std::span<const TrueReturn> returns);
  Status close() { return out_.close(); }

 private:
  ByteWriter out_;
};

class TruthReader {
 public:
  /// Errors: Io, Malformed.
  static Result<TruthReader> open(const std::string& path);
  const TruthHeader& header() const { return header_; }
  /// The returns of the next packet; EndOfData after the last. Places are exact to 0.5 um.
  Result<std::vector<TrueReturn>> next_packet();

 private:
  explicit TruthReader(const std::string& path) : in_(path) {}
  ByteReader in_;
  TruthHeader header_;
};

}  // namespace hueline::sim
