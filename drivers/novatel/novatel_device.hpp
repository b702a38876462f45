#pragma once

#include <memory>
#include <optional>
#include <string>

#include "drivers/device.hpp"
#include "drivers/novatel/decoder.hpp"
#include "drivers/novatel/logs.hpp"
#include "drivers/transport/stream_input.hpp"

namespace hueline::drivers {

/// A NovAtel receiver of a rig.
class NovatelDevice final : public Device {
 public:
  void visit(Keys& keys) override;
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override { return input_.arrivals(); }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override;
  std::unique_ptr<Decoder> make_decoder() const override;

  /// Returns the commands that the receiver is sent after each connection. It is empty if the rig asks for no logs.
  std::string dialogue() const;

 private:
  StreamInput input_;
  std::optional<NovatelLogs::Config> logs_;
  NovatelDecoder::Config decoder_;
};

/// The device type with `driver: novatel`.
extern const DeviceType kNovatel;

}  // namespace hueline::drivers
