#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/mutex.hpp"
#include "core/result.hpp"
#include "sim/devices/socket.hpp"

namespace hueline::sim {

/// Sends PPS edges over a local socket (AF_UNIX, SOCK_SEQPACKET), for machines without a /dev/ppsN. Each edge is one
/// message of 24 bytes, little endian:
///   offset  0  u32  0x31535050 "PPS1"
///   offset  4  u32  1 (assert)
///   offset  8  u64  count of edges
///   offset 16  i64  CLOCK_MONOTONIC_RAW of the edge, ns
/// Thread-safe.
class PpsServer {
 public:
  struct Config {
    std::string path = "/tmp/hueline-pps";  ///< path of the socket; an old socket there is replaced
    std::string validate() const;
  };

  /// Opens the socket and starts the thread that accepts clients. Errors: Invalid (configuration; the path exists and
  /// is not a socket), or what the system says of the socket.
  static Result<std::unique_ptr<PpsServer>> open(const Config& config);
  explicit PpsServer(const Config& config) : config_(config) {}
  ~PpsServer();

  /// Sends an edge to every client; never waits. Returns how many clients could not take it.
  int publish(std::uint64_t sequence, std::int64_t edge_monotonic_raw_ns);
  /// Returns the number of connected clients.
  int clients() const;

 private:
  void run(const std::stop_token& stop);

  const Config config_;
  FileDescriptor listener_, wake_;
  mutable Mutex mutex_;
  std::vector<FileDescriptor> clients_ HUELINE_GUARDED_BY(mutex_);
  std::jthread thread_;
};

}  // namespace hueline::sim
