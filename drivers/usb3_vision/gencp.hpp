#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.hpp"
#include "drivers/gige/camera_memory.hpp"

/// The control channel of a USB3 Vision camera: GenCP 1.3 (EMVA), whose commands read and write the camera's memory.
/// Numbers are little endian, as USB3 Vision 1.0 sets for its cameras.
namespace hueline::drivers {

/// Carries messages to a camera and back.
class MessageChannel {
 public:
  virtual ~MessageChannel() = default;
  /// Errors: TimedOut, Disconnected, Io.
  virtual Status send(std::span<const std::byte> message) = 0;
  /// Waits for a message and returns its size. What does not fit into `out` is an error. Errors: TimedOut,
  /// Disconnected, Io.
  virtual Result<std::size_t> receive(std::span<std::byte> out, std::chrono::milliseconds limit) = 0;
};

/// Sends one command at a time and waits for its answer. A command without an answer is sent again under the same
/// number, by which the camera knows it; an answer that comes late belongs to an earlier number and is ignored.
/// Thread safety: none; one thread calls all functions. The channel has to outlive the client.
class GencpClient final : public CameraMemory {
 public:
  /// What the camera can take. The defaults are those that every camera has.
  struct Limits {
    std::size_t command_bytes = 128, answer_bytes = 128;  ///< of a whole message
    std::chrono::milliseconds answers_within{1000};
  };
  explicit GencpClient(MessageChannel& channel) : channel_(channel) {}
  /// Sets the limits; those below the smallest of the standard are raised to it.
  void set_limits(const Limits& limits);

  Status read(std::uint64_t address, std::span<std::byte> out) override;
  Status write(std::uint64_t address, std::span<const std::byte> bytes) override;

 private:
  using Bytes = std::vector<std::byte>;
  Result<Bytes> ask(std::uint16_t command, const Bytes& body, std::uint64_t address);
  Result<Bytes> wait_for_answer(std::uint16_t command, std::uint64_t address);

  MessageChannel& channel_;
  Limits limits_;
  std::uint16_t number_ = 0;
};

}  // namespace hueline::drivers
