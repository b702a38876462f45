#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "core/mutex.hpp"
#include "core/result.hpp"
#include "sim/devices/pos_commands.hpp"
#include "sim/devices/socket.hpp"

namespace hueline::sim {

/// The Ethernet port of a NovAtel receiver. It listens, executes the LOG commands of each client and sends each client
/// the logs that it asked for. A client that does not read loses logs, as with a real receiver, and delays nobody.
/// Thread-safe.
class PosServer {
 public:
  struct Config {
    std::string address = "127.0.0.1";
    std::uint16_t port = 3001;  ///< ICOM1 of an OEM7; 0: the kernel chooses, see port()
    /// Executed for each new client without an answer, as by a receiver with SAVECONFIG.
    std::vector<std::string> saved_commands;
    /// How much a client may leave unread beyond the kernel's buffer.
    std::size_t client_buffer_bytes = 1U << 20U;
    std::string validate() const;
  };
  /// Numbers of logs since the server was opened.
  struct Counts {
    std::uint64_t logs_sent = 0;      ///< handed to a client; counted for each client
    std::uint64_t logs_unwanted = 0;  ///< logs that no client had asked for
    std::uint64_t logs_dropped = 0;   ///< logs that were wanted by a client whose buffer was full
  };

  /// Opens the port and starts the thread that serves clients. Errors: Invalid (configuration), or what the system says
  /// of the port.
  static Result<std::unique_ptr<PosServer>> open(const Config& config);
  explicit PosServer(const Config& config) : config_(config) {}
  ~PosServer();

  std::uint16_t port() const { return bound_port(listener_); }
  /// Hands a log to every client that asked for it; never waits. `what` is the log that the bytes were made as, even if
  /// they were changed since; bytes with id 0 go to every client that asked for anything. `piece_bytes` is the size of
  /// the pieces in which it is sent; 0: all at once.
  void publish(std::span<const std::byte> log, const NovatelPeek& what, std::size_t piece_bytes = 0);
  void publish(std::span<const std::byte> log) { publish(log, peek_novatel(log)); }
  /// Returns the number of clients that have asked for at least one log.
  int listening_clients() const;
  Counts counts() const;
  /// Returns true once every client has been sent all that was published for it.
  bool is_drained() const;

 private:
  struct Client {
    FileDescriptor socket;
    PosSubscriptions subscriptions;
    std::string command;       ///< the part of the next line that was received so far
    std::vector<char> unsent;  ///< whole messages; the first may have been sent in part
    bool is_gone = false;
  };
  void run(const std::stop_token& stop);
  void accept_client() HUELINE_REQUIRES(mutex_);
  void read_commands(Client& client) HUELINE_REQUIRES(mutex_);
  void send(Client& client, std::span<const char> bytes) HUELINE_REQUIRES(mutex_);
  void flush(Client& client) HUELINE_REQUIRES(mutex_);

  const Config config_;
  FileDescriptor listener_, wake_;
  mutable Mutex mutex_;
  std::vector<std::unique_ptr<Client>> clients_ HUELINE_GUARDED_BY(mutex_);
  Counts counts_ HUELINE_GUARDED_BY(mutex_);
  std::jthread thread_;  // last member, because it must stop before the members that it uses are destroyed
};

}  // namespace hueline::sim
