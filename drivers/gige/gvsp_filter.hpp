#pragma once

#include <linux/filter.h>
#include <netinet/in.h>

#include <cstdint>
#include <vector>

#include "core/result.hpp"

/// Filters for the sockets of Aravis, run by the kernel (classic BPF). Aravis 0.8.26 does not check a datagram's
/// content type and packet number. A trailer that claims a million packets makes it allocate memory for them, and it
/// then writes data with such a number outside the image. The filters bound the numbers by the size of an image, so
/// neither can happen, whatever the order of datagrams. Upstream Aravis bounds them since January 2025; Debian 12 does
/// not have that version.
namespace hueline::drivers {

/// The parameters of a stream as agreed with the camera.
struct GvspStreamShape {
  in_addr camera{}, own{};
  std::uint16_t own_port = 0;       ///< in host byte order
  std::uint64_t payload_bytes = 0;  ///< bytes of one image
  std::uint32_t packet_bytes = 0;   ///< largest packet with IP and UDP headers, as in the camera's register
};

/// Makes the filter of a UDP socket. It passes datagrams from the camera's address that are not longer than agreed and
/// are either the leader of an image (packet number 0), data (1 to the last packet of an image) or a trailer (2 to one
/// after the last), with 16-bit or extended ids. It drops everything else without counting it, because a datagram that
/// Aravis cannot use is no loss.
std::vector<sock_filter> gvsp_filter_of_udp_socket(const GvspStreamShape& shape);
/// Makes the same filter for a packet socket, which sees everything that passes the interface. It passes only whole,
/// unfragmented UDP datagrams to the stream's port.
std::vector<sock_filter> gvsp_filter_of_packet_socket(const GvspStreamShape& shape);
/// Makes a filter that passes only datagrams from the camera's control port.
std::vector<sock_filter> gvcp_filter(in_addr camera);
/// Makes a filter that drops everything.
std::vector<sock_filter> filter_of_nothing();

/// Replaces the filter of `socket`. Errors: Io.
Status attach_filter(int socket, const std::vector<sock_filter>& filter);

/// Returns the sockets of this process that have this domain and type. Use it for sockets that a library does not give
/// out.
std::vector<int> own_sockets(int domain, int type);
/// Returns the IPv4 address and port that `socket` is bound to.
sockaddr_in bound_address(int socket);

}  // namespace hueline::drivers
