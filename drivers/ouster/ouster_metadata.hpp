#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

/// What an Ouster says of itself in JSON: its metadata, without which nobody can read its packets, and the state of its
/// clock. Source: Ouster's public documentation of sensor metadata and of the HTTP interface.
/// Thread safety: the functions may be called from several threads at the same time.
namespace hueline::drivers {

/// What the channel data of one UDP profile consists of. Every profile has all that is used in the first 8 bytes of a
/// pixel, little endian.
struct OusterProfile {
  const char* name;         ///< the maker's
  std::size_t pixel_bytes;  ///< 4 to 20
  std::uint32_t range_mask;
  int range_shift;              ///< the range is (word & mask) << shift, mm
  std::size_t reflectivity_at;  ///< byte of the pixel
  /// Whether bytes 4 to 7 are a second return; its reflectivity is at byte `reflectivity_at` + 4.
  bool is_dual;
};

/// The profiles that are known. The first one is LEGACY, whose packets have no header.
std::span<const OusterProfile> ouster_profiles();

/// What the time stamps of a scanner's packets count.
enum class OusterTimestampMode : std::uint8_t {
  Unknown,     ///< metadata of old firmware do not say
  Oscillator,  ///< time since the scanner was switched on
  SyncPulse,   ///< pulses at its input; with a receiver's sentences, the time that they tell
  Ptp,         ///< time since 1970 on the time scale of the PTP master, which is TAI or UTC
};

/// The metadata of one scanner.
struct OusterMetadata {
  std::string product;                   ///< "OS-1-128"; empty if not told
  std::string firmware;                  ///< "v2.3.0"; empty if not told
  std::optional<std::uint64_t> serial;   ///< number of the scanner
  std::optional<std::uint32_t> init_id;  ///< of the initialisation at which the scanner told its metadata
  const OusterProfile* profile = nullptr;
  bool is_fusa = false;  ///< the packets have the header FUSA
  /// The reflectivity has 16 bits, as firmware before 2.1 sends it in the LEGACY profile; the upper 8 are used.
  bool has_wide_reflectivity = false;
  int channels = 0, columns_per_packet = 16, columns_per_frame = 0;
  int window_first = 0, window_last = 0;  ///< columns that are sent; through 0 if the first is larger
  std::vector<double> altitudes_deg;      ///< by channel
  std::vector<double> azimuths_deg;       ///< by channel; clockwise seen from above
  /// Origin of the beams at encoder angle 0, m: along the axis of the encoder angle 0, and upwards.
  double beam_x_m = 0, beam_z_m = 0;
  Eigen::Matrix3d R_sensor_lidar = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_sensor_lidar_m = Eigen::Vector3d::Zero();  ///< the centre of the beams in the maker's sensor frame
  OusterTimestampMode timestamp_mode = OusterTimestampMode::Unknown;
  bool reads_nmea = false;    ///< a receiver's sentences set the seconds
  int nmea_leap_seconds = 0;  ///< that the scanner adds to UTC

  std::size_t head_bytes() const { return is_legacy() ? 0 : 32; }
  std::size_t column_head_bytes() const { return is_legacy() ? 16 : 12; }
  std::size_t column_bytes() const {
    return column_head_bytes() + profile->pixel_bytes * static_cast<std::size_t>(channels) + (is_legacy() ? 4 : 0);
  }
  std::size_t packet_bytes() const {
    return head_bytes() + column_bytes() * static_cast<std::size_t>(columns_per_packet) + (is_legacy() ? 0 : 32);
  }
  bool is_legacy() const { return profile == ouster_profiles().data(); }
  /// For people: "OS-1-128".
  std::string name() const;
};

/// Returns whether a packet is JSON text and no datagram of an Ouster: those begin with another byte or end with one.
bool is_json(std::span<const std::byte> bytes);

/// Reads metadata: the nested form of firmware 2.1 and later, or the flat form of earlier programs. What old firmware
/// does not tell has the maker's value for it. Errors: Malformed (no JSON, or a key with a wrong value; the message
/// names it), Unsupported (JSON that is no metadata, or a kind of Ouster that is not read).
Result<OusterMetadata> parse_ouster_metadata(std::string_view text);

/// What the scanner answered when it was asked for its time.
struct OusterClock {
  bool is_pulse_locked = false, is_nmea_locked = false;
  std::string ptp_state;                                    ///< of the scanner's port: "SLAVE"
  std::optional<double> ptp_offset_ns;                      ///< its clock minus the master's
  OusterTimestampMode mode = OusterTimestampMode::Unknown;  ///< in use
};
/// Reads the answer. Errors: Malformed; Unsupported if the text is none.
Result<OusterClock> parse_ouster_clock(std::string_view text);

}  // namespace hueline::drivers
