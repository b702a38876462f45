#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
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
  std::vector<std::string> not_supported;  ///< senders that may be scanners and are not known, in words
  Status written;                          ///< why a cloud could not be written whole
  Status trouble;                          ///< why the file was read in part or not at all; whole parts of it were used
};

/// Reads the capture twice: once to learn what its scanners say of their time, and once to write their points. With one
/// scanner the cloud is `out`; with several, each cloud has its scanner's address in its name.
/// Errors: what prevents that any cloud is written (Unsupported: no scanner that is known).
Result<DecodedCapture> decode_capture(const DecodeOptions& options,
                                      drivers::DeviceTypes types = drivers::device_types());

}  // namespace hueline::apps
