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

/// A profile scanner of the RIEGL VUX/VMX class in the generic wire format (docs/formats.md): data datagrams ->
/// LaserBatch (one each, also when no return is left), status datagrams -> LaserStatus and, once a second, TimeLabel.
///
/// LaserBatch::time is the emission of the datagram's first pulse on the scale that the datagram names; a return's time
/// is that of its own pulse. Frame: Scanner (z along the mirror's axis; angle 0 along y, growing clockwise seen from
/// +z, so towards x). All lines lie in its plane z = 0: channel is 0. return_number counts by range, 1 is the nearest;
/// return_count is that of the pulse also where a range limit dropped some.
///
/// Faults, each at most once a second with what came since: Malformed (magic, length, version, counts, fields out of
/// range), Lost (datagrams by the packet counter), Late (a datagram that was told as lost came after all; it is used),
/// Spurious (one that came twice; not used), WrongDevice (another scanner's id), Lost with count 1 where the counter
/// leapt: a restart. Thread-bound.
class ProfileScannerDecoder final : public Decoder {
 public:
  struct Config {
    int scanner_id = 0;        ///< as its datagrams name it; 0: the first that speaks
    double min_range_m = 1.0;  ///< nearer returns are dropped: the housing, the vehicle's roof
    double max_range_m = 1000;
    /// Angles kept, rad, from begin to end in the sense of growing angles (through 0 if end < begin). [0, 2 pi]:
    /// everything.
    double angle_begin = 0;
    double angle_end = 6.283185307179586;

    void visit(Keys& keys);
    KeyError validate() const;
  };

  ProfileScannerDecoder(SensorId sensor, const Config& config);
  ~ProfileScannerDecoder() override;
  ProfileScannerDecoder(const ProfileScannerDecoder&) = delete;
  ProfileScannerDecoder& operator=(const ProfileScannerDecoder&) = delete;

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }

 private:
  void malformed(const Packet& packet, const std::string& what, std::vector<Measurement>& out);
  bool is_ours(const Packet& packet, const ProfileHeader& header, std::vector<Measurement>& out);
  /// False: the datagram came twice.
  bool follow(const Packet& packet, const ProfileHeader& header, std::optional<std::uint32_t> line,
              std::vector<Measurement>& out);
  void decode_data(const Packet& packet, const ProfileHeader& header, std::vector<Measurement>& out);
  void decode_status(const Packet& packet, const ProfileHeader& header, std::vector<Measurement>& out);
  void label(const Packet& packet, const ProfileHeader& header, const ProfileStatus& status,
             std::vector<Measurement>& out);

  SensorId sensor_;
  Config config_;
  std::unique_ptr<ProfileScannerKernel> kernel_;
  DecodeCounts counts_;
  CounterWatch data_counter_, status_counter_;
  std::optional<std::uint16_t> scanner_;
  std::optional<TimeLabel> last_label_;
};

}  // namespace hueline::drivers
