#include <fmt/format.h>

#include "drivers/wheel/wheel_decoder.hpp"

namespace hueline::drivers {

std::string WheelDecoder::Config::validate() const {
  if (messages.empty()) return "messages must name at least one message";
  int counting = 0;
  for (const Message& message : messages) {
    if (message.id > (message.is_extended ? 0x1FFFFFFFU : 0x7FFU))
      return fmt::format("id: {} does not fit into {} bits", message.id, message.is_extended ? 29 : 11);
    for (const Message& other : messages)
      if (&other != &message && other.id == message.id && other.is_extended == message.is_extended)
        return fmt::format("id: {} is named twice", message.id);
    if (message.speeds.empty() && message.pulses.empty())
      return fmt::format("id: message {} has neither a speed nor pulses", message.id);
    counting += message.pulses.empty() ? 0 : 1;
    for (const CanSignal& signal : message.speeds)
      if (std::string wrong = signal.validate(); !wrong.empty()) return wrong;
    for (const Pulses& pulses : message.pulses) {
      if (std::string wrong = pulses.signal.validate(); !wrong.empty()) return wrong;
      if (pulses.signal.bits > 32) return "bits: pulses have at most 32";
      if (!(pulses.metres_per_pulse > 0 && pulses.metres_per_pulse <= 10))
        return "metres_per_pulse must be above 0 and at most 10";
      if (pulses.signal.is_signed || pulses.signal.min != 0) return "signed, min: pulses count up from 0";
      if (counter_range(pulses.signal).count < 3) return "max: pulses count to 2 at least";
    }
    if (message.counter) {
      if (std::string wrong = message.counter->validate(); !wrong.empty()) return wrong;
      if (message.counter->bits > 32 || message.counter->is_signed)
        return "bits: a rolling counter has at most 32, and no sign";
      if (counter_range(*message.counter).count < 3) return "bits: a rolling counter has three values at least";
    }
    if (message.checksum && message.checksum->byte > 63) return "byte must be within 0 .. 63";
  }
  if (counting > 1) return "messages: pulses are counted from one message alone";
  if (!(sigma_speed > 0 && sigma_speed <= 10)) return "sigma_speed must be above 0 and at most 10";
  if (!(max_speed > 0 && max_speed <= 200)) return "max_speed must be above 0 and at most 200";
  if (!(max_acceleration > 0 && max_acceleration <= 1000)) return "max_acceleration must be above 0 and at most 1000";
  return {};
}

}  // namespace hueline::drivers
