#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "core/result.hpp"
#include "sim/devices/pos_commands.hpp"
#include "sim/devices/socket.hpp"

namespace hueline::sim {

/// A NovAtel receiver's Ethernet port: listens, obeys LOG commands of each client, sends it what it asked for. A client
/// that does not read loses logs, as with a receiver; it holds up nobody. Thread-safe.
class PosServer {
 public:
  struct Config {
    std::string address = "127.0.0.1";
    std::uint16_t port = 3001;                ///< ICOM1 of an OEM7; 0: the kernel's choice, see port()
    std::vector<std::string> saved_commands;  ///< executed for each new client, unanswered: a receiver with SAVECONFIG
    std::size_t client_buffer_bytes = 1U << 20U;  ///< what a client may leave unread, beyond the kernel's buffer
    std::string validate() const;
  };
  struct Counts {
    std::uint64_t logs_sent = 0;      ///< handed to a client, counted once for each client
    std::uint64_t logs_unwanted = 0;  ///< that no client had asked for
    std::uint64_t logs_dropped = 0;   ///< wanted by a client whose buffer was full
  };

  static Result<std::unique_ptr<PosServer>> open(const Config& config);
  explicit PosServer(const Config& config) : config_(config) {}
  ~PosServer();

  std::uint16_t port() const { return bound_port(listener_); }
  /// Hands a log to every client that asked for it; never waits. `what`: the log that the bytes were, whatever has
  /// become of them; id 0 goes to everyone who asked for anything. `piece_bytes`: sent in pieces of so many; 0: whole.
  void publish(std::span<const std::byte> log, const NovatelPeek& what, std::size_t piece_bytes = 0);
  void publish(std::span<const std::byte> log) { publish(log, peek_novatel(log)); }
  /// Clients that have asked for at least one log.
  int listening_clients() const;
  Counts counts() const;
  /// True once every client has been sent all that was published.
  bool is_drained() const;

 private:
  struct Client {
    FileDescriptor socket;
    PosSubscriptions subscriptions;
    std::string command;       ///< received so far of the next line
    std::vector<char> unsent;  ///< whole messages; the first may be sent in part
    bool is_gone = false;
  };
  void run(const std::stop_token& stop);
  void accept_client();
  void read_commands(Client& client);
  void send(Client& client, std::span<const char> bytes);
  void flush(Client& client);

  const Config config_;
  FileDescriptor listener_, wake_;
  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<Client>> clients_;  // by mutex_, as is counts_
  Counts counts_;
  std::jthread thread_;  // last: stops before what it uses goes away
};

}  // namespace hueline::sim
