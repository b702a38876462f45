#pragma once

#include <netinet/in.h>

#include <string>

#include "core/result.hpp"

namespace hueline::sim {

struct InterfaceAddress {
  in_addr own{};
  in_addr broadcast{};  ///< of its subnet
};

/// IPv4 of a network interface by name ("eth1"), or of an address that lies in the subnet of one ("127.0.0.2" is on
/// lo). Unavailable: there is none.
Result<InterfaceAddress> find_interface(const std::string& name_or_address);

}  // namespace hueline::sim
