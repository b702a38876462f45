#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"
#include "drivers/device.hpp"

/// Makes clouds of the laser scanners in a capture file, each in the scanner's own frame.
namespace hueline::apps {

/// How decode_capture() works.
struct DecodeOptions {
  std::string capture;                    ///< pcap or pcapng
  std::filesystem::path out;              ///< ends with .las or .pcd
  std::vector<std::string> descriptions;  ///< files of CaptureListener::use_description
  /// Where a scanner counts only within the hour and names no hour: an instant within half an hour of the first
  /// datagram.
  std::optional<GpsTime> near;
  bool trusts_arrivals = false;  ///< as `near`: the times at which the capture file says that the datagrams came
};

/// The cloud of one scanner.
struct DecodedScanner {
  std::string name, note;  ///< what the scanner is; what the user must know of the decoding
  std::string address;     ///< its IP address
  std::filesystem::path cloud;
  std::uint64_t points = 0;
  std::map<int, std::uint64_t> points_by_return;
  std::string clock;                  ///< in words, what the times of the cloud count
  std::optional<GpsTime> begin, end;  ///< of the points, if their times are absolute
  std::map<std::string, std::uint64_t> faults;
  std::map<std::string, std::string> fault_details;  ///< the newest of each kind
};

/// What a capture file gave.
struct DecodedCapture {
  std::vector<DecodedScanner> scanners;
  std::vector<std::string> not_supported;   ///< senders that may be scanners and are not known, in words
  std::set<std::string> used_descriptions;  ///< those of DecodeOptions::descriptions by which a scanner was decoded
  /// By file of DecodeOptions::descriptions that a scanner refused: why.
  std::map<std::string, std::string> refused_descriptions;
  Status written;  ///< why a cloud could not be written whole
  Status trouble;  ///< why the file was read in part or not at all; whole parts of it were used
};

/// A capture file whose scanners are known, after its first reading.
class KnownCapture {
 public:
  /// Reads the file once, to learn what its scanners say of their time. Errors: what prevents reading.
  static Result<KnownCapture> learn(const DecodeOptions& options, drivers::DeviceTypes types = drivers::device_types());
  KnownCapture(KnownCapture&&) noexcept;
  KnownCapture& operator=(KnownCapture&&) = delete;
  ~KnownCapture();

  std::size_t scanners() const;
  /// Returns whether a device was recognised, be it a scanner or another one.
  bool has_devices() const;
  /// Returns, for people, what is in a capture without a known device, and why it is none.
  std::string why_none() const;
  /// Does the same for packets that are known to be those of one topic of a recording.
  std::string why_none_of_topic() const;
  /// Returns whether it has packets that may be those of a scanner that is not supported (DecodedCapture).
  bool has_unknown_scanner() const;
  /// Reads the file again, to write the points of its scanners to `out`. With several scanners each cloud has its
  /// scanner's address in its name. Errors: what prevents that any cloud is written.
  Result<DecodedCapture> write(const std::filesystem::path& out);

 private:
  struct State;
  explicit KnownCapture(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Learns and writes: the clouds of the scanners in one capture file. With one scanner the cloud is `options.out`.
/// Errors: what prevents that any cloud is written (Unsupported: no scanner that is known).
Result<DecodedCapture> decode_capture(const DecodeOptions& options,
                                      drivers::DeviceTypes types = drivers::device_types());

}  // namespace hueline::apps
