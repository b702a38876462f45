#pragma once

#include <memory>

#include "drivers/device.hpp"
#include "drivers/transport/datagram_input.hpp"

namespace hueline::drivers {

/// A device that only sends datagrams, all of which DeviceDecoder reads. Its keys are those of the input
/// (DatagramInput) and those of the decoder.
template <class DeviceDecoder>
class DatagramDevice final : public Device {
 public:
  void visit(Keys& keys) override {
    input_.visit(keys);
    decoder_.visit(keys);
  }
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override { return input_.arrivals(); }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override { return input_.make(pool); }
  std::unique_ptr<Decoder> make_decoder() const override { return std::make_unique<DeviceDecoder>(decoder_); }

 private:
  DatagramInput input_;
  typename DeviceDecoder::Config decoder_;
};

}  // namespace hueline::drivers
