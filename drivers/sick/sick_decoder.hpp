#pragma once

#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/keys.hpp"
#include "drivers/sick/sick_telegram.hpp"
#include "drivers/stream/stream_decoder.hpp"

namespace hueline::drivers {

/// Decodes the telegrams of SICK's scanners with one plane (LMS5xx, LMS1xx), in CoLa-A and CoLa-B. What it knows comes
/// from public descriptions and from captures of an LMS511 and an LMS111.
///
///   LMDscandata                     a LaserBatch for each scan, and a LaserStatus when what it says changes
///   sFA, or an answer "refused"     Fault Refused
///   a gap of the telegram counter   Fault Lost
///   a telegram that came twice      Fault Spurious; it is not used
///   values that are cut             Fault Malformed
///   scans of several planes         Fault WrongDevice; they are not used
///   no clock, though the rig says   Fault NoTime; the scan is not used
///
/// Frame: Scanner (x where the scanner counts 0 deg, y where it counts 90 deg, which is ahead, z along the mirror's
/// axis so that angles grow towards +y). All points lie in z = 0, so the channel is 0. return_number counts by range; 1
/// is the nearest. Reflectivity is the upper 8 bits of RSSI, as the scanner scales it.
///
/// LaserBatch::time is the first firing: the scanner's stamp of the scan, which names the mirror's zero index, and the
/// time in which the mirror turns from there to the first angle.
class SickDecoder final : public StreamDecoder {
 public:
  /// The stamp of a scan that is used.
  enum class Clock : std::uint8_t {
    Counter,  ///< microseconds since power-up, 32 bits
    Utc,      ///< the date and time in the telegram, of a clock that NTP has set
  };
  struct Config {
    Clock clock = Clock::Counter;
    double index_angle = -std::numbers::pi / 2;  ///< rad; the mirror's angle at the stamp
    double min_range_m = 0.1;                    ///< nearer returns are dropped
    double max_range_m = 100;                    ///< farther returns are dropped
    /// The angles that are kept, rad, from begin to end.
    double angle_begin = -std::numbers::pi, angle_end = 2 * std::numbers::pi;
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit SickDecoder(const Config& config);

 private:
  bool take(const Message& message) override;
  void forget() override;
  bool take_scan(const SickTelegram& telegram, HostTime received);
  bool follow(std::uint16_t telegrams, HostTime received);
  void tell_status(const SickScan& scan, HostTime received);
  std::vector<LaserReturn> returns_of(const SickScan& scan) const;

  const Config config_;
  std::optional<std::uint16_t> telegrams_;
  std::string words_;  // of the latest LaserStatus
  bool has_no_clock_ = false, has_planes_ = false;
};

/// What a scanner is asked for after each connection.
struct SickOutput {
  enum class Form : std::uint8_t { ColaA, ColaB };
  enum class Echoes : std::uint8_t { First, All, Last };
  Form form = Form::ColaB;
  Echoes echoes = Echoes::First;
  bool rssi = true;
  void visit(Keys& keys);
  KeyError validate() const { return check_keys(*this); }
  /// Returns the bytes to send: login, output, start.
  std::string dialogue() const;
};

}  // namespace hueline::drivers
