#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/decoder.hpp"
#include "core/keys.hpp"
#include "drivers/arrival_watch.hpp"
#include "drivers/hesai/hesai_model.hpp"
#include "drivers/hesai/hesai_wire.hpp"
#include "drivers/message_counter.hpp"
#include "drivers/profile_scanner/counter_watch.hpp"

namespace hueline::drivers {

class HesaiKernel;

/// Decodes the packets of the scanners in HesaiModel. Each data packet gives one LaserBatch, even if no return is left.
/// A GPS packet (usually port 10110) gives a LaserStatus. While the clock is known to be locked, each second gives a
/// TimeLabel.
///
/// LaserBatch::time is the first firing of the packet as Unix time, from the UTC that each packet carries. A return has
/// the time of its own firing, and the azimuth of the head at that time plus the beam's own. Several returns of a
/// firing are counted by range; equal ones are one. Frame: Scanner (z up, y forward at azimuth 0, x right; azimuth
/// clockwise from above).
///
/// Faults:
/// - Malformed: a wrong size, or a field out of its range.
/// - WrongDevice: a packet of another model.
/// - NoTime: the scanner has no date yet; the packet is not used.
/// - Lost, Late, Spurious: by the number of the packets, if they have one.
/// - Silent: nothing came for a while, and what was sent then comes late (ArrivalWatch).
/// - ClockStep: the stamp jumped relative to the arrival.
///
/// Thread safety: none; one thread calls all functions.
class HesaiDecoder final : public Decoder {
 public:
  /// What the scanner's clock follows.
  enum class Reference : std::uint8_t {
    Told,    ///< what its GPS packets say; without them its clock counts as unlocked
    PtpUtc,  ///< PTP with the UTC time scale
    PtpTai,  ///< PTP with TAI, which is 37 s ahead of UTC (since 2017) and never has a leap second
  };
  struct Config {
    HesaiModel model = HesaiModel::Pandar40P;
    Reference reference = Reference::Told;
    double min_range_m = 0.05;          ///< nearer returns are dropped, such as those of the housing
    std::optional<double> max_range_m;  ///< farther returns are dropped; without it all are kept
    /// The directions of the beams, by channel, from the scanner's own calibration file. Both are empty for the nominal
    /// directions, which the beams of a scanner miss by some tenths of a degree.
    std::vector<double> elevations_deg, azimuths_deg;

    void visit(Keys& keys);
    KeyError validate() const;
  };

  explicit HesaiDecoder(const Config& config);
  ~HesaiDecoder() override;
  HesaiDecoder(const HesaiDecoder&) = delete;
  HesaiDecoder& operator=(const HesaiDecoder&) = delete;

  void decode(const Packet& packet, std::vector<Measurement>& out) override;
  void reset() override;
  const DecodeCounts& counts() const override { return counts_; }

 private:
  void decode_gps(const Packet& packet, const HesaiGps& gps, std::vector<Measurement>& out);
  void refuse(const Packet& packet, FaultKind kind, const std::string& what, std::vector<Measurement>& out);
  bool follow(const Packet& packet, const HesaiPacket& data, std::vector<Measurement>& out);
  void check_clock(const Packet& packet, UnixTime time, std::vector<Measurement>& out);
  void label(const Packet& packet, UnixTime time, std::vector<Measurement>& out);
  bool is_locked(HostTime now) const;

  SensorId sensor_ = kSystemSensor;
  Config config_;
  const HesaiTable& table_;
  std::unique_ptr<HesaiKernel> kernel_;
  DecodeCounts counts_;
  MessageCounter data_;  ///< of the packets of points

  CounterWatch counter_;
  struct Previous {
    UnixTime time;
    HostTime received;
  };
  std::optional<Previous> previous_;
  ArrivalWatch arrivals_;
  std::optional<LaserStatus> status_;
  std::optional<TimeLabel> last_label_;
};

}  // namespace hueline::drivers
