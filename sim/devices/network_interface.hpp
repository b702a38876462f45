#pragma once

#include <netinet/in.h>

#include <string>

#include "core/result.hpp"

namespace hueline::sim {

/// The IPv4 addresses of a network interface.
struct InterfaceAddress {
  in_addr own{};
  in_addr broadcast{};  ///< broadcast address of its subnet
};

/// Finds a network interface by its name ("eth1") or by an address that lies in its subnet ("127.0.0.2" is on lo).
/// Errors: Unavailable (there is none).
Result<InterfaceAddress> find_interface(const std::string& name_or_address);

}  // namespace hueline::sim
