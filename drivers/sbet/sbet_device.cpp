#include "drivers/sbet/sbet_device.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "drivers/sbet/sbet_decoder.hpp"
#include "drivers/transport/file_source.hpp"

namespace hueline::drivers {
namespace {

class SbetDevice final : public Device {
 public:
  void visit(Keys& keys) override {
    keys.text(required("file", "",
                       "A trajectory that was calculated after the drive (SBET). It does not say when its bytes "
                       "arrived, so no clock of the computer can be learnt from it."),
              file_);
    decoder_.visit(keys);
  }
  KeyError validate() const override { return decoder_.validate(); }
  Arrivals arrivals() const override { return Arrivals::Unknown; }
  std::unique_ptr<PacketSource> make_source(const BufferPool&) const override {
    FileSource::Config file;
    file.path = file_;
    return std::make_unique<FileSource>(file);
  }
  std::unique_ptr<Decoder> make_decoder() const override { return std::make_unique<SbetDecoder>(decoder_); }

 private:
  std::string file_;
  SbetDecoder::Config decoder_;
};

/// Two records that could follow one another: nothing else marks an SBET.
bool is_sbet(std::string_view first_bytes) {
  std::array<std::array<double, kSbetDoubles>, 2> two{};
  if (first_bytes.size() < sizeof(two)) return false;
  std::memcpy(two.data(), first_bytes.data(), sizeof(two));
  const auto& [a, b] = two;
  constexpr double kLongest_s = 10, kFarthest = 1e-3;  // rad: 6 km
  return impossible_sbet(a).empty() && impossible_sbet(b).empty() && b[0] > a[0] && b[0] - a[0] < kLongest_s &&
         std::abs(b[1] - a[1]) < kFarthest && std::abs(b[2] - a[2]) < kFarthest && (a[1] != 0 || a[2] != 0);
}

}  // namespace

constinit const DeviceType kSbet{.word = "sbet",
                                 .role = Role::Pos,
                                 .is_sheddable = false,
                                 .make = make_device<SbetDevice>,
                                 .files = {.log = {.format = "SBET", .ending = ".sbet", .is_beginning = is_sbet}}};

}  // namespace hueline::drivers
