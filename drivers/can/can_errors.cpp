#include "drivers/can/can_errors.hpp"

#include <fmt/format.h>
#include <linux/can/error.h>

#include <utility>

namespace hueline::drivers {
namespace {

using Words = std::initializer_list<std::pair<unsigned, const char*>>;

std::string words_of(unsigned bits, Words words) {
  std::string out;
  for (const auto& [bit, word] : words)
    if (bits & bit) out += (out.empty() ? "" : ", ") + std::string(word);
  return out.empty() ? "not told" : out;
}

std::string counters(const CanFrame& frame) {
  return (frame.id & CAN_ERR_CNT) != 0 || frame.data[6] != 0 || frame.data[7] != 0
             ? fmt::format("; its error counters: {} sending, {} receiving", frame.data[6], frame.data[7])
             : std::string();
}

}  // namespace

std::vector<CanTrouble> explain_can_error(const CanFrame& frame) {
  std::vector<CanTrouble> out;
  if (frame.id & CAN_ERR_BUSOFF)
    out.push_back({FaultKind::Disconnected,
                   "the controller is off the bus (bus-off): wrong bit rate, missing terminator or broken wire? It "
                   "comes back by itself where restart-ms is set" +
                       counters(frame)});
  if (frame.id & CAN_ERR_RESTARTED)
    out.push_back({FaultKind::Reconnected, "the controller was restarted after bus-off"});
  if (frame.id & CAN_ERR_CRTL) {
    const unsigned state = frame.data[1];
    if (state & CAN_ERR_CRTL_RX_OVERFLOW)
      out.push_back({FaultKind::Lost, "the controller's own buffer was full: frames are missing"});
    constexpr unsigned kBad =
        CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING | CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE;
    if (state & kBad)
      out.push_back({FaultKind::Malformed,
                     fmt::format("many frames break on the bus: the controller is {}{}",
                                 state & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE) ? "error passive"
                                                                                             : "at its warning level",
                                 counters(frame))});
  }
  if (frame.id & (CAN_ERR_PROT | CAN_ERR_BUSERROR | CAN_ERR_ACK)) {
    const std::string type = words_of(frame.data[2], {{CAN_ERR_PROT_BIT, "bit"},
                                                      {CAN_ERR_PROT_FORM, "form"},
                                                      {CAN_ERR_PROT_STUFF, "stuffing"},
                                                      {CAN_ERR_PROT_BIT0, "bit 0"},
                                                      {CAN_ERR_PROT_BIT1, "bit 1"},
                                                      {CAN_ERR_PROT_OVERLOAD, "overload"}});
    out.push_back(
        {FaultKind::Malformed, fmt::format("a frame broke on the bus ({}{}): bit rate, terminators, wiring?", type,
                                           frame.id & CAN_ERR_ACK                      ? ", no acknowledge"
                                           : frame.data[3] == CAN_ERR_PROT_LOC_CRC_SEQ ? ", check sum"
                                                                                       : "")});
  }
  if (frame.id & CAN_ERR_TRX && frame.data[4] != 0)
    out.push_back(
        {FaultKind::Malformed, fmt::format("the transceiver sees a fault of the wires: code {:02x}", frame.data[4])});
  return out;
}

CanFrame broken_frame(std::uint8_t bus) {
  CanFrame frame;
  frame.bus = bus;
  frame.is_error = true;
  frame.id = CAN_ERR_PROT | CAN_ERR_BUSERROR;
  frame.length = CAN_ERR_DLC;
  return frame;
}

}  // namespace hueline::drivers
