#pragma once

#include <memory>
#include <optional>
#include <string>
#include <type_traits>

#include "drivers/device.hpp"
#include "drivers/transport/can_input.hpp"
#include "drivers/transport/stream_input.hpp"

namespace hueline::drivers {

/// A device that sends messages in a stream of bytes, all of which DeviceDecoder reads. Its keys are those of the input
/// (StreamInput), those of the decoder, and `logs` if the device can be asked for messages.
///
/// `Traits` has:
///
///   static constexpr const char* kLog       what the maker's files are, a sentence
///   static constexpr bool kHasDatagrams     the device also sends its messages by UDP
///   using Logs                              a Config with `std::string dialogue() const`, or void
///   using OnCan                             its decoder on a CAN bus; absent if it has none, or sends datagrams
template <class DeviceDecoder, class Traits>
class StreamDevice final : public Device {
 public:
  StreamDevice() {
    input_.has_datagrams = Traits::kHasDatagrams;
    input_.has_can = kHasCan;
  }

  void visit(Keys& keys) override {
    input_.visit(keys, Traits::kLog);
    if constexpr (kHasCan) bus_.visit(keys);
    if constexpr (kCanAsk)
      keys.section({"logs", "", "What the device is asked for after each connection. `{}` asks for the defaults.",
                    "nothing is sent"},
                   logs_);
    decoder_.visit(keys);
  }
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override {
    if constexpr (kHasCan)
      if (bus_.is_set()) return bus_.arrivals();
    return input_.arrivals();
  }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override {
    if constexpr (kHasCan)
      if (bus_.is_set()) return bus_.make(pool);
    return input_.make(pool, dialogue());
  }
  std::unique_ptr<Decoder> make_decoder() const override {
    if constexpr (kHasCan)
      if (bus_.is_set()) return std::make_unique<typename Traits::OnCan>();
    return std::make_unique<DeviceDecoder>(decoder_);
  }

  /// Returns what the device is sent after each connection. It is empty if the rig asks for nothing.
  std::string dialogue() const {
    if constexpr (kCanAsk)
      if (logs_) return logs_->dialogue();
    return {};
  }

 private:
  static constexpr bool kCanAsk = !std::is_void_v<typename Traits::Logs>;
  static constexpr bool kHasCan = requires { typename Traits::OnCan; };
  struct Nothing {};

  StreamInput input_;
  std::conditional_t<kHasCan, CanInput, Nothing> bus_{};
  std::conditional_t<kCanAsk, std::optional<typename Traits::Logs>, Nothing> logs_{};
  typename DeviceDecoder::Config decoder_;
};

}  // namespace hueline::drivers
