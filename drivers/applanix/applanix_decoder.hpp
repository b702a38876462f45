#pragma once

#include <cstdint>
#include <optional>

#include "core/keys.hpp"
#include "drivers/stream/second_labels.hpp"
#include "drivers/stream/stream_decoder.hpp"

namespace hueline::drivers {

/// Decodes the groups of an Applanix POS LV, AV or MV, from its real-time or logging port (TCP), its display port (UDP)
/// or its files.
///
///   group                                      measurement
///   1  position, velocity, attitude            InsSolution
///   2  their errors                            InsUncertainty
///   5, 6  event 1, 2                           EventMark
///   7  time of the pulse                       TimeLabel, if the POS calls itself synchronised
///   3  GNSS status                             the GPS week and the leap seconds, which no other group has
///   4  IMU; 10  status; raw data               recorded and counted
///   bytes that are skipped                     Fault Malformed, with their number
///   groups that never came                     Fault Lost, judged by their period
///   no week yet, POS time, not synchronised    Fault NoTime; what would need the time is not emitted or not trusted
///
/// Each group says which scales its two times are on; the one on GPS or else on UTC is used. Firmware that counts weeks
/// modulo 1024 is taken to speak of the years from 2012 on.
class ApplanixDecoder final : public StreamDecoder {
 public:
  struct Config {
    bool accepts_fine_alignment = false;  ///< also call a solution good whose heading is better than 15 deg only
    void visit(Keys& keys);
    KeyError validate() const { return check_keys(*this); }
  };
  explicit ApplanixDecoder(const Config& config);

 private:
  using Group = std::span<const std::byte>;

  bool take(const Message& message) override;
  void forget() override;
  bool take_group(int number, const Message& message);
  bool take_solution(Group group, GpsTime time, HostTime received);
  void take_status(Group group);
  std::optional<GpsTime> time_of(Group group, HostTime received);

  const Config config_;
  std::optional<int> week_;
  std::optional<std::chrono::seconds> utc_offset_;
  std::optional<GpsTime> latest_;
  std::optional<bool> is_synchronised_;  // by the latest group 7
  SecondLabels seconds_;
  bool has_no_time_ = false, is_unsynchronised_ = false;
};

}  // namespace hueline::drivers
