#pragma once

#include <memory>
#include <optional>

#include "drivers/device.hpp"
#include "drivers/transport/can_log_source.hpp"
#include "drivers/transport/can_source.hpp"
#include "drivers/transport/udp_source.hpp"

namespace hueline::drivers {

/// The origin of the frames of a CAN bus: the bus, a gateway, or a log. At most one of its members is set.
struct CanInput {
  std::optional<CanSource::Config> can;
  std::optional<UdpSource::Config> cannelloni;
  std::optional<CanLogSource::Config> log;

  /// Declares the keys `can`, `cannelloni` and `can_log`. The caller declares which keys exclude each other.
  void visit(Keys& keys);
  bool is_set() const { return can || cannelloni || log; }
  Arrivals arrivals() const { return log ? Arrivals::Recorded : Arrivals::Live; }
  /// Makes the source that is set, not opened yet.
  std::unique_ptr<PacketSource> make(const BufferPool& pool) const;
};

}  // namespace hueline::drivers
