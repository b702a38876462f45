#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/result.hpp"
#include "sim/devices/socket.hpp"

namespace hueline::sim {

/// PPS edges over a local socket, for machines without a /dev/ppsN: AF_UNIX, SOCK_SEQPACKET, one message an edge, 24
/// bytes little endian: u32 0x31535050 "PPS1", u32 1 (assert), u64 count of edges, i64 CLOCK_MONOTONIC_RAW ns of the
/// edge. Thread-safe.
class PpsServer {
 public:
  struct Config {
    std::string path = "/tmp/hueline-pps";  ///< of the socket; an old socket there is replaced
    std::string validate() const;
  };

  static Result<std::unique_ptr<PpsServer>> open(const Config& config);
  explicit PpsServer(const Config& config) : config_(config) {}
  ~PpsServer();

  /// Tells every client; never waits. Returns how many could not take it.
  int publish(std::uint64_t sequence, std::int64_t edge_monotonic_raw_ns);
  int clients() const;

 private:
  void run(const std::stop_token& stop);

  const Config config_;
  FileDescriptor listener_, wake_;
  mutable std::mutex mutex_;
  std::vector<FileDescriptor> clients_;  // by mutex_
  std::jthread thread_;
};

}  // namespace hueline::sim
