#pragma once

#include <linux/filter.h>
#include <netinet/in.h>

#include <cstdint>
#include <vector>

#include "core/result.hpp"

/// What may reach Aravis's stream socket, decided by the kernel (classic BPF). Aravis 0.8.26 takes a datagram's content
/// type and packet number as they come: a trailer that claims a million packets makes it allocate for them, and data of
/// such a number is then written outside the image. With numbers bounded by the size of an image neither can happen,
/// whatever the order of datagrams. Upstream bounds them since January 2025; Debian 12 does not.
namespace hueline::drivers {

/// A stream as it was agreed with the camera.
struct GvspStreamShape {
  in_addr camera{}, own{};
  std::uint16_t own_port = 0;       ///< host byte order
  std::uint64_t payload_bytes = 0;  ///< of an image
  std::uint32_t packet_bytes = 0;   ///< with IP and UDP headers, as in the camera's register
};

/// Passes datagrams from the camera's address that are no longer than agreed and are a leader of an image (number 0),
/// data (1 to the last of an image) or a trailer (2 to the number behind), with 16-bit or with extended ids. Everything
/// else is dropped, and not counted: a datagram that Aravis has no use for is no loss.
std::vector<sock_filter> gvsp_filter_of_udp_socket(const GvspStreamShape& shape);
/// The same for a packet socket, which sees whatever passes the interface: whole, unfragmented UDP datagrams to the
/// stream's port alone.
std::vector<sock_filter> gvsp_filter_of_packet_socket(const GvspStreamShape& shape);
/// Datagrams from the camera's control port alone.
std::vector<sock_filter> gvcp_filter(in_addr camera);
std::vector<sock_filter> filter_of_nothing();

/// Replaces the filter of `socket`. Io.
Status attach_filter(int socket, const std::vector<sock_filter>& filter);

/// This process's sockets of a domain and type: libraries keep theirs to themselves.
std::vector<int> own_sockets(int domain, int type);
sockaddr_in bound_address(int socket);

}  // namespace hueline::drivers
