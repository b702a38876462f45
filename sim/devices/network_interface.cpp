#include "sim/devices/network_interface.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>

#include <cerrno>
#include <memory>

namespace hueline::sim {

Result<InterfaceAddress> find_interface(const std::string& name_or_address) {
  in_addr wanted{};
  const bool is_address = ::inet_pton(AF_INET, name_or_address.c_str(), &wanted) == 1;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return io_error("list the network interfaces", errno);
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owner(first, ::freeifaddrs);
  for (const ifaddrs* i = first; i != nullptr; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_netmask == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
    const in_addr own = reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr;
    const in_addr mask = reinterpret_cast<const sockaddr_in*>(i->ifa_netmask)->sin_addr;
    const bool is_it = is_address ? ((own.s_addr ^ wanted.s_addr) & mask.s_addr) == 0 : name_or_address == i->ifa_name;
    if (!is_it) continue;
    InterfaceAddress found;
    found.own = is_address ? wanted : own;
    found.broadcast.s_addr = own.s_addr | ~mask.s_addr;
    return found;
  }
  return Error{ErrorCode::Unavailable,
               fmt::format("no network interface with IPv4 is or contains '{}'", name_or_address)};
}

}  // namespace hueline::sim
