#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/byte_file.hpp"
#include "sim/drive.hpp"
#include "sim/scene.hpp"
#include "sim/vec3.hpp"

/// truth.bin holds the truth of a drive. Little-endian, no padding. A text is a u32 length and that many bytes of
/// UTF-8. Places are in the local level of the scene's origin, in m. Files of the version before (HLTRUTH1: without
/// gains, targets, albedo, light and flags) are refused; render them again.
///
///   header
///     char[8]  "HLTRUTH2"
///     f64[3]   scene's origin: latitude, longitude (rad), ellipsoidal height (m)
///     text     scenario, one line "key=value" a key
///     u32      number of surfaces; then of each
///       text     name
///     u32      number of sphere targets; then of each
///       u16      surface
///       f64[3]   centre
///       f64      radius, m
///     u32      number L of lenses
///     u32      number of exposures; then of each
///       u32      number of the exposure
///       i64      middle of the exposure, GPS ns
///       f64[9]   R_enu_head, row-major
///       f64[3]   p_enu_head
///       f32[L]   factor of each lens on its light
///   packet, repeated until the end of the file
///     i64      first firing, GPS ns
///     f64[3]   place of the scanner at that time
///     u32      number of returns; then of each 46 bytes:
///       offset  0  u32     time of the firing after the first firing, ns
///       offset  4  u16     channel
///       offset  6  u16     surface
///       offset  8  i32[3]  TrueReturn::beam_* minus the scanner's place, um
///       offset 20  i32[3]  true hit minus the scanner's place, um
///       offset 32  u8[3]   red, green, blue
///       offset 35  u8      flags; 1: the surface moves by itself
///       offset 36  u8[3]   albedo
///       offset 39  u8      f: how many binary digits finer the unit of the light is; 0 by full daylight
///       offset 40  u16[3]  light, 2^-(14 + f)
namespace hueline::sim {

/// What stands once in the file, before the packets.
struct TruthHeader {
  double origin_latitude_rad = 0, origin_longitude_rad = 0, origin_height_m = 0;
  std::string scenario;
  std::vector<std::string> surfaces;
  std::vector<SphereTarget> targets;
  std::vector<TrueExposure> exposures;
  /// Whether dark returns have finer steps of light, as a night needs. It decides how returns are written and does not
  /// stand in the file itself, where each return says it.
  bool has_fine_light = false;
};

constexpr char kTruthMagic[] = "HLTRUTH2";

/// Writes truth.bin. Call `close()` at the end: it reports the first error of all calls.
class TruthWriter {
 public:
  TruthWriter(const std::string& path, const TruthHeader& header);
  /// Writes the returns of one packet. `scanner_enu` is the place of the scanner at `first_firing`.
  void packet(GpsNs first_firing, Vec3 scanner_enu, std::span<const TrueReturn> returns);
  Status close() { return out_.close(); }

 private:
  ByteWriter out_;
  bool has_fine_light_;
};

/// Reads truth.bin, packet by packet.
class TruthReader {
 public:
  /// Opens the file and reads its header. Errors: Io, Malformed.
  static Result<TruthReader> open(const std::string& path);
  const TruthHeader& header() const { return header_; }
  /// Returns the returns of the next packet, or EndOfData after the last. Places are exact to 0.5 um.
  Result<std::vector<TrueReturn>> next_packet();

 private:
  explicit TruthReader(const std::string& path) : in_(path) {}
  ByteReader in_;
  TruthHeader header_;
};

}  // namespace hueline::sim
