#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/result.hpp"
#include "drivers/ladybug/ladybug_settings.hpp"

/// Sets up a Ladybug by its registers: those of IIDC 1.31 (the 1394 Trade Association's digital camera specification),
/// and Point Grey's own where IIDC has none (their register reference).
namespace hueline::drivers {

/// Reads and writes the 32-bit registers of a camera at the addresses of IEEE 1394 (48 bits).
class RegisterAccess {
 public:
  virtual ~RegisterAccess() = default;
  virtual Result<std::uint32_t> read(std::uint64_t address) = 0;
  virtual Status write(std::uint64_t address, std::uint32_t value) = 0;
};

/// Returns the serial number of the camera. Errors: those of the access.
Result<std::uint32_t> read_serial(RegisterAccess& camera);

/// Ends the camera's stream, sets everything that `settings` names and reads it back. Returns the number of bytes that
/// the camera will send for each image at most. Errors: Invalid, the camera has not or did not take a setting, with its
/// range where it tells one; those of the access.
Result<std::size_t> set_up(RegisterAccess& camera, const LadybugSettings& settings);

/// Starts or ends the stream. Errors: those of the access.
Status set_streaming(RegisterAccess& camera, bool is_on);

}  // namespace hueline::drivers
