#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "core/input_file.hpp"
#include "core/keys.hpp"
#include "core/packet.hpp"
#include "drivers/can/blf.hpp"
#include "drivers/can/can_log.hpp"
#include "drivers/transport/can_capture.hpp"

namespace hueline::drivers {

/// Reads the frames of a log of a CAN bus (drivers/can/can_log.hpp, drivers/can/blf.hpp, can_capture.hpp) as fast as
/// they are asked for. The packets have the form of CanSource's packets. `received` is the time stamp in the log: the
/// clock of the computer that logged takes the place of HostTime. So do not use this source together with live sources
/// in one drive. What breaks the format of the log is counted, and one Fault Malformed reports it at the end. Fault
/// WrongDevice reports once that a log of candump or a capture has frames of several interfaces and none is named: the
/// ids of two buses are not the same messages. Thread safety: none; one thread calls all functions.
class CanLogSource final : public PacketSource {
 public:
  struct Config {
    std::string path;
    int channel = 0;           ///< number of the channel that is read, in a log that has numbers; 0 reads all channels
    std::string interface {};  ///< that is read from a log of candump or a capture; empty reads all

    void visit(Keys& keys);
    KeyError validate() const;
  };

  explicit CanLogSource(Config config) : config_(std::move(config)) {}

  Status open() override;
  /// Returns the interface that the log names for the latest frame; empty: the log has none, but numbers.
  const std::string& interface() const { return interface_; }
  /// Returns what stands in the log beside frames of a CAN bus, by its kind in words (only a BLF has other kinds).
  std::map<std::string, std::uint64_t> passed_over() const {
    return blf_ ? blf_->passed_over() : std::map<std::string, std::uint64_t>();
  }
  /// Returns which line of a text was the first that is no frame, and why, without the file's name; empty if there was
  /// none, or if the log is no text.
  const std::string& first_bad_line() const { return first_bad_line_; }
  Result<Packet> next(std::stop_token stop) override;
  void close() override {
    file_.reset();
    input_.reset();
    blf_.reset();
    capture_.reset();
  }

 private:
  Result<std::optional<CanLogEntry>> next_entry();
  Result<std::optional<CanLogEntry>> next_line();
  const Config config_;
  std::optional<InputFile> input_;     // protects the file from being overwritten by this program while it is read
  std::optional<std::ifstream> file_;  // a text
  CanLogParser parser_;
  std::optional<BlfReader> blf_;
  std::optional<CanCapture> capture_;
  std::uint64_t line_ = 0, malformed_ = 0;
  std::string first_malformed_, first_bad_line_;
  std::string interface_, first_interface_;
  bool are_several_told_ = false;
  std::optional<Packet> waiting_;  // the frame behind a fault
  HostTime last_{};
};

}  // namespace hueline::drivers
