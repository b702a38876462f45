#include "drivers/wheel/wheel_device.hpp"

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "drivers/transport/can_input.hpp"
#include "drivers/transport/described_source.hpp"
#include "drivers/wheel/wheel_decoder.hpp"

namespace hueline::drivers {
namespace {

class WheelDevice final : public OdometerDevice {
 public:
  void visit(Keys& keys) override {
    keys.one_of({"can", "cannelloni", "can_log"});
    bus_.visit(keys);
    decoder_.visit(keys);
  }
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override { return bus_.arrivals(); }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override {
    if (decoder_.database.empty()) return bus_.make(pool);
    return std::make_unique<DescribedSource>(bus_.make(pool), [config = decoder_] { return describe(config); });
  }
  std::unique_ptr<Decoder> make_decoder() const override { return std::make_unique<WheelDecoder>(decoder_); }
  bool is_by_gateway() const override { return bus_.cannelloni.has_value(); }

 private:
  /// Returns the packet of the database, if it describes the signals of the rig.
  static Result<std::vector<std::byte>> describe(const WheelDecoder::Config& config) {
    constexpr std::uint64_t kMostBytes = 16'000'000;
    const auto text = read_input(config.database, kMostBytes, "a DBC");
    if (!text.ok()) return text.error();
    const auto found = config.find_signals(*text);
    if (!found.ok()) return Error{ErrorCode::Invalid, config.database + ": " + found.error().message};
    return encode_database_packet(*text);
  }

  CanInput bus_;
  WheelDecoder::Config decoder_;
};

}  // namespace

constinit const DeviceType kWheel{"wheel", Role::Odometer, false, make_device<WheelDevice>};

}  // namespace hueline::drivers
