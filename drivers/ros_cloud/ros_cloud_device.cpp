#include "drivers/ros_cloud/ros_cloud_device.hpp"

#include <memory>

#include "drivers/ros/ros_cloud_decoder.hpp"
#include "drivers/stamped_device.hpp"

namespace hueline::drivers {
namespace {

/// Messages of ROS come from recordings alone.
class NoSource final : public PacketSource {
 public:
  Status open() override {
    return Error{ErrorCode::Unsupported,
                 "point clouds of ROS cannot be captured; hueline decode reads those of a recording"};
  }
  Result<Packet> next(std::stop_token) override { return Error{ErrorCode::EndOfData, "no source"}; }
  void close() override {}
};

class RosCloudDevice final : public StampedDevice {
 public:
  void visit(Keys& keys) override { decoder_.visit(keys); }
  KeyError validate() const override { return decoder_.validate(); }
  std::unique_ptr<PacketSource> make_source(const BufferPool&) const override { return std::make_unique<NoSource>(); }
  nanoseconds stamp_sigma() const override { return decoder_.stamp_sigma; }
  std::unique_ptr<Decoder> make_decoder() const override { return std::make_unique<RosCloudDecoder>(decoder_); }

 private:
  RosCloudDecoder::Config decoder_;
};

}  // namespace

// The decoder's batches span 1 ms.
constinit const DeviceType kRosCloud{.word = "ros_cloud",
                                     .role = Role::Laser,
                                     .is_sheddable = true,
                                     .make = make_device<RosCloudDevice>,
                                     .laser = {.latency_min = std::chrono::milliseconds(1)}};

}  // namespace hueline::drivers
