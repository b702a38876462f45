#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>

#include "core/packet.hpp"
#include "core/pixel_rows.hpp"
#include "runtime/ingest.hpp"

namespace hueline::runtime {

/// Reads one device: opens its source, hands its packets to Ingest, reports its troubles, and opens it again with
/// back-off. The trouble of one device never affects another.
class Reader {
 public:
  struct Config {
    std::chrono::milliseconds first_back_off{250};  ///< doubled at each failure
    /// A device that returns streams again within 2 s: this, and what its opening takes.
    std::chrono::milliseconds longest_back_off{1500};
    /// The device is connected, but sends no packet for this long: a Fault Silent, once for each silence.
    std::chrono::milliseconds silent_after{3000};
    /// The source is a file. It is read no faster than its packets are recorded and processed. It is read only once: an
    /// error ends it, because a file that is opened again would start from its beginning.
    bool is_recording = false;
    /// Finds the rows of an image in a packet, which the recording packs; empty: nothing is packed.
    std::function<PixelRows(std::span<const std::byte>)> pixel_rows{};
  };
  /// What the reader is doing. Silent means connected, but without packets.
  enum class State : std::uint8_t { Connecting, Running, Silent, Ended };

  /// `host_now` stamps the faults; a test passes its own clock.
  Reader(SensorId sensor, std::string name, std::unique_ptr<PacketSource> source, Config config, Ingest& ingest,
         std::function<HostTime()> host_now);

  /// Runs until stop, EndOfData, or an error that no retry can cure (Invalid, Unsupported; any error of a recording).
  void run(std::stop_token stop);

  /// Returns the error that ended a recording before its end. Valid after run().
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
