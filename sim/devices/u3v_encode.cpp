#include "sim/devices/u3v_encode.hpp"

#include <initializer_list>
#include <utility>

#include "sim/wire/little_endian.hpp"

namespace hueline::sim {
namespace {

constexpr std::uint32_t kControlMagic = 0x43563355, kLeaderMagic = 0x4C563355, kTrailerMagic = 0x54563355;
constexpr std::uint16_t kPendingAcknowledge = 0x0805;
constexpr std::uint16_t kVendor = 0x1209, kProduct = 0x0001;  // pid.codes: numbers for tests

// Numbers of the strings.
constexpr std::uint8_t kMaker = 1, kModel = 2, kSerial = 3, kGuid = 4, kVersion = 5;

void put_interface(LittleEndianWriter& out, int number, int endpoints, int protocol) {
  out.put_bytes({9, 4, number, 0, endpoints, 0xEF, 0x05, protocol, 0});
}

/// Puts a bulk endpoint and its SuperSpeed companion.
void put_endpoint(LittleEndianWriter& out, int address, int burst) {
  out.put_bytes({7, 5, address, 2});
  out.put(static_cast<std::uint16_t>(UsbPort::kPacketBytes));
  out.put_bytes({0, 6, 0x30, burst, 0, 0, 0});
}

Bytes device_descriptor() {
  LittleEndianWriter out(18);
  out.put_bytes({18, 1, 0x00, 0x03, 0xEF, 0x02, 0x01, 9});  // USB 3.0, several functions by association, 2^9 bytes
  out.put(kVendor);
  out.put(kProduct);
  out.put_bytes({0x00, 0x01, kMaker, kModel, kSerial, 1});
  return out.take();
}

Bytes configuration_descriptor() {
  LittleEndianWriter rest(128);
  rest.put_bytes({8, 0x0B, 0, 2, 0xEF, 0x05, 0, 0});  // the two interfaces are one camera
  put_interface(rest, 0, 2, 0);
  // U3V device information, of the class: versions of GenCP and USB3 Vision, numbers of strings, speeds.
  rest.put_bytes({20, 0x24, 0x01});
  rest.put(std::uint32_t{0x0001'0003});
  rest.put(std::uint32_t{0x0001'0000});
  rest.put_bytes({kGuid, kMaker, kModel, 0, kVersion, 0, kSerial, 0, 0x08});
  put_endpoint(rest, 0x80 | kU3vControlEndpoint, 0);
  put_endpoint(rest, kU3vControlEndpoint, 0);
  put_interface(rest, 1, 1, 2);
  put_endpoint(rest, 0x80 | kU3vStreamEndpoint, 15);

  LittleEndianWriter out(160);
  out.put_bytes({9, 2});
  out.put(static_cast<std::uint16_t>(9 + rest.size()));
  out.put_bytes({2, 1, 0, 0x80, 112});  // 112 times 8 mA from the bus
  Bytes whole = out.take();
  whole.insert(whole.end(), rest.bytes().begin(), rest.bytes().end());
  return whole;
}

Bytes capabilities_descriptor() {
  LittleEndianWriter out(22);
  out.put_bytes({5, 15, 22, 0, 2});
  out.put_bytes({7, 16, 2, 0, 0, 0, 0});               // USB 2.0 extension, without link power management
  out.put_bytes({10, 16, 3, 0, 0x0E, 0, 1, 0, 0, 0});  // SuperSpeed
  return out.take();
}

void put_message_head(LittleEndianWriter& out, std::uint32_t magic, std::uint16_t size, std::uint64_t block_id) {
  out.put(magic);
  out.put(std::uint16_t{0});
  out.put(size);
  out.put(block_id);
}

void put_control_head(LittleEndianWriter& out, std::uint16_t status, std::uint16_t command, std::size_t size,
                      std::uint16_t request_id) {
  out.put(kControlMagic);
  out.put(status);
  out.put(command);
  out.put(static_cast<std::uint16_t>(size));
  out.put(request_id);
}

}  // namespace

UsbDescriptors u3v_descriptors(const std::string& maker, const std::string& model, const std::string& version,
                               const std::string& serial, const std::string& guid) {
  return {device_descriptor(),
          configuration_descriptor(),
          capabilities_descriptor(),
          {maker, model, serial, guid, version}};
}

Bytes encode_u3v_leader(const U3vImage& image) {
  LittleEndianWriter out(kU3vLeaderBytes);
  put_message_head(out, kLeaderMagic, kU3vLeaderBytes, image.block_id);
  out.put(std::uint16_t{0});
  out.put(image.payload_type);
  out.put(image.timestamp_ns);
  out.put(image.pixel_format);
  out.put(image.width);
  out.put(image.height);
  out.put(image.offset_x);
  out.put(image.offset_y);
  out.put_zeros(4);  // padding of rows, and reserved
  return out.take();
}

Bytes encode_u3v_trailer(const U3vImage& image, std::uint64_t valid_bytes) {
  LittleEndianWriter out(kU3vTrailerBytes);
  put_message_head(out, kTrailerMagic, kU3vTrailerBytes, image.block_id);
  out.put_zeros(4);  // status and reserved
  out.put(valid_bytes);
  out.put(image.height);
  return out.take();
}

Bytes encode_gencp_acknowledge(std::uint16_t command, GencpStatus status, std::uint16_t request_id, const Bytes& data) {
  LittleEndianWriter out(12);
  put_control_head(out, static_cast<std::uint16_t>(status), static_cast<std::uint16_t>(command + 1), data.size(),
                   request_id);
  Bytes whole = out.take();
  whole.insert(whole.end(), data.begin(), data.end());
  return whole;
}

Bytes encode_gencp_pending(std::uint16_t request_id, std::uint16_t within_ms) {
  LittleEndianWriter out(16);
  put_control_head(out, 0, kPendingAcknowledge, 4, request_id);
  out.put(std::uint16_t{0});
  out.put(within_ms);
  return out.take();
}

}  // namespace hueline::sim
