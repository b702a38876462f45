#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/profile_scanner/counter_watch.hpp"
#include "drivers/profile_scanner/profile_scanner_wire.hpp"

namespace hueline::drivers {

class ProfileScannerKernel;

/// Decodes a profile scanner of the RIEGL VUX/VMX class in the generic wire format (profile_scanner_wire.hpp,
/// docs/formats.md). Each data datagram gives one LaserBatch, even if no return is left. Each status datagram gives a
/// LaserStatus and, once a second, a TimeLabel.
///
/// LaserBatch::time is the emission of the datagram's first pulse, on the time scale that the datagram names; a return
/// has the time of its own pulse. Frame: Scanner (z along the mirror's axis; angle 0 along y, growing clockwise seen
/// from +z, so towards x). All lines lie in its plane z = 0, so channel is 0. return_number counts by range; 1 is the
/// nearest. return_count is that of the pulse, even if a range limit dropped some.
///
/// Faults:
/// - Malformed: wrong magic, length, version or counts, or a field out of its range.
/// - Lost: datagrams missing by the counter. With count 1: the counter jumped, because the scanner restarted.
/// - Late: a datagram that was reported as lost came after all. It is used.
/// - Spurious: a datagram came twice. It is used once.
/// - WrongDevice: a datagram of another scanner.
///
/// Thread safety: none; one thread calls all functions.
class ProfileScannerDecoder final : public Decoder {
 public:
  struct Config {
    int scanner_id = 0;        ///< number of the scanner in its datagrams; 0 takes the first scanner that sends
    double min_range_m = 1.0;  ///< nearer returns are dropped, such as those of the housing and the vehicle's roof
    double max_range_m = 1000;
    /// The angles that are kept, rad, from begin to end in the direction of growing angles (through 0 if end < begin).
    /// The default keeps all.
    double angle_begin = 0;
    double angle_end = 6.283185307179586;

    void visit(Keys& keys);
    KeyError validate() const;
  };

  explicit ProfileScannerDecoder(const Config& config);
  ~ProfileScannerDecoder() override;
  ProfileScannerDecoder(const ProfileScannerDecoder&) = delete;
  ProfileScannerDecoder& operator=(const ProfileScannerDecoder&) = delete;

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }

 private:
  void malformed(const Packet& packet, const std::string& what, std::vector<Measurement>& out);
  bool is_ours(const Packet& packet, const ProfileHeader& header, std::vector<Measurement>& out);
  /// Follows the counters and reports losses. Returns false if the datagram came twice.
  bool follow(const Packet& packet, const ProfileHeader& header, std::optional<std::uint32_t> line,
              std::vector<Measurement>& out);
  void decode_data(const Packet& packet, const ProfileHeader& header, std::vector<Measurement>& out);
  void decode_status(const Packet& packet, const ProfileHeader& header, std::vector<Measurement>& out);
  void label(const Packet& packet, const ProfileHeader& header, const ProfileStatus& status,
             std::vector<Measurement>& out);

  SensorId sensor_ = kSystemSensor;  // of the packet that is decoded, or was last
  Config config_;
  std::unique_ptr<ProfileScannerKernel> kernel_;
  DecodeCounts counts_;
  CounterWatch data_counter_, status_counter_;
  std::optional<std::uint16_t> scanner_;
  std::optional<TimeLabel> last_label_;
};

}  // namespace hueline::drivers
