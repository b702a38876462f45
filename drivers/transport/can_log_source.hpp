#pragma once

#include <fstream>
#include <optional>
#include <string>

#include "core/input_file.hpp"
#include "core/keys.hpp"
#include "core/packet.hpp"
#include "drivers/can/can_log.hpp"

namespace hueline::drivers {

/// The frames of a log of a CAN bus (drivers/can/can_log.hpp), as fast as they are asked for, in the packets that
/// CanSource makes. `received` is the log's stamp: the clock of the computer that logged stands for HostTime. Do not
/// mix with live sources in one drive. Lines that break their format are counted, and told once at the end: Fault
/// Malformed. Thread-bound.
class CanLogSource final : public PacketSource {
 public:
  struct Config {
    std::string path;
    int channel = 0;  ///< ASC: only this one; 0: all

    void visit(Keys& keys);
    KeyError validate() const;
  };

  CanLogSource(SensorId sensor, Config config) : sensor_(sensor), config_(std::move(config)) {}

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override {
    file_.reset();
    input_.reset();
  }

 private:
  const SensorId sensor_;
  const Config config_;
  std::optional<InputFile> input_;  // what is read: not to be written over meanwhile
  std::optional<std::ifstream> file_;
  CanLogParser parser_;
  std::uint64_t line_ = 0, malformed_ = 0;
  std::string first_malformed_;
  HostTime last_{};
};

}  // namespace hueline::drivers
