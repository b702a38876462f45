#include "drivers/wheel/wheel_device.hpp"

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "drivers/transport/can_log_source.hpp"
#include "drivers/transport/can_source.hpp"
#include "drivers/transport/described_source.hpp"
#include "drivers/transport/udp_source.hpp"
#include "drivers/wheel/wheel_decoder.hpp"

namespace hueline::drivers {
namespace {

class WheelDevice final : public OdometerDevice {
 public:
  void visit(Keys& keys) override {
    keys.one_of({"can", "cannelloni", "can_log"});
    keys.section({"can", "",
                  "The bus by SocketCAN, which listens only. Set the interface up first: `ip link set can0 up type can "
                  "bitrate 500000 restart-ms 100`."},
                 can_);
    keys.section({"cannelloni", "",
                  "Datagrams of a CAN-to-Ethernet gateway that speaks "
                  "[cannelloni](https://github.com/mguentner/cannelloni), usually on port 20000. It may gather frames "
                  "before it sends them (its option `-t`): `stamp_delay_us` and `stamp_sigma_us` have to say so."},
                 cannelloni_);
    keys.section({"can_log", "", "A log of the bus."}, log_);
    decoder_.visit(keys);
  }
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override { return log_ ? Arrivals::Recorded : Arrivals::Live; }
  std::unique_ptr<PacketSource> make_source(const BufferPool& pool) const override {
    if (decoder_.database.empty()) return make_bus(pool);
    return std::make_unique<DescribedSource>(make_bus(pool), [config = decoder_] { return describe(config); });
  }
  std::unique_ptr<Decoder> make_decoder() const override { return std::make_unique<WheelDecoder>(decoder_); }
  bool is_by_gateway() const override { return cannelloni_.has_value(); }

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
  std::unique_ptr<PacketSource> make_bus(const BufferPool& pool) const {
    if (log_) return std::make_unique<CanLogSource>(*log_);
    if (cannelloni_) return std::make_unique<UdpSource>(*cannelloni_, pool);
    return std::make_unique<CanSource>(can_.value(), pool);
  }

  std::optional<CanSource::Config> can_;
  std::optional<UdpSource::Config> cannelloni_;
  std::optional<CanLogSource::Config> log_;
  WheelDecoder::Config decoder_;
};

}  // namespace

constinit const DeviceType kWheel{"wheel", Role::Odometer, false, make_device<WheelDevice>};

}  // namespace hueline::drivers
