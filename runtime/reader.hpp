#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "core/packet.hpp"
#include "runtime/ingest.hpp"

namespace hueline::runtime {

/// One device's thread: opens its source, hands on what comes, reports what does not, and opens again with back-off.
/// Trouble of one device never touches another.
class Reader {
 public:
  struct Config {
    std::chrono::milliseconds first_back_off{250};  ///< doubled at each failure
    std::chrono::milliseconds longest_back_off{5000};
    std::chrono::milliseconds silent_after{
        3000};  ///< connected, but no packet for so long: Fault Silent, once a silence
    /// A file as source: read no faster than its packets are recorded and processed, and once: an error ends it,
    /// because opened again it would begin anew.
    bool is_recording = false;
  };
  enum class State : std::uint8_t { Connecting, Running, Silent, Ended };

  /// `host_now` stamps faults; a test passes its own.
  Reader(SensorId sensor, std::string name, std::unique_ptr<PacketSource> source, Config config, Ingest& ingest,
         std::function<HostTime()> host_now);

  /// Until stop, EndOfData, or an error that no retry mends (Invalid, Unsupported; any of a recording's).
  void run(std::stop_token stop);

  /// The error that ended a recording before its end. After run().
  const Status& outcome() const { return outcome_; }
  State state() const { return state_.load(std::memory_order_relaxed); }
  SensorId sensor() const { return sensor_; }
  const std::string& sensor_name() const { return name_; }

 private:
  bool read_until_trouble(std::stop_token stop);  // false: over for good
  bool take_error(const Error& error);            // false: over for good
  void fault(FaultKind kind, std::string detail);

  const SensorId sensor_;
  const std::string name_;
  const std::unique_ptr<PacketSource> source_;
  const Config config_;
  Ingest& ingest_;
  const std::function<HostTime()> host_now_;
  std::atomic<State> state_{State::Connecting};
  Status outcome_;
};

}  // namespace hueline::runtime
