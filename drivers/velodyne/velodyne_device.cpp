#include "drivers/velodyne/velodyne_device.hpp"

#include "drivers/transport/datagram_input.hpp"
#include "drivers/velodyne/velodyne_decoder.hpp"

namespace hueline::drivers {
namespace {

class VelodyneDevice final : public Device {
 public:
  void visit(Keys& keys) override {
    input_.visit(keys);
    decoder_.visit(keys);
  }
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override { return input_.arrivals(); }
  std::unique_ptr<PacketSource> make_source(SensorId sensor, const BufferPool& pool) const override { return input_.make(sensor, pool); }
  std::unique_ptr<Decoder> make_decoder(SensorId sensor) const override { return std::make_unique<VelodyneDecoder>(sensor, decoder_); }

 private:
  DatagramInput input_;
  VelodyneDecoder::Config decoder_;
};

}  // namespace

constinit const DeviceType kVelodyne{"velodyne", Role::Laser, true, make_device<VelodyneDevice>};

}  // namespace hueline::drivers
