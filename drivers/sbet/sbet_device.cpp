#include "drivers/sbet/sbet_device.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/portable_math.hpp"
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

/// Returns whether record `b` could follow `a`: later by a moment, and no farther away than a vehicle comes in it. The
/// velocities of some programs are 0.
bool could_follow(std::span<const double> a, std::span<const double> b) {
  constexpr double kLeastStep_s = 1e-4, kMostStep_s = 10, kRadius_m = 6.4e6, kMargin_m = 1, kMargin_m_s = 100;
  const double time = b[0] - a[0];
  if (!(time >= kLeastStep_s && time < kMostStep_s)) return false;
  const double speed = std::max(portable::hypot(a[4], a[5], a[6]), portable::hypot(b[4], b[5], b[6]));
  const double east = (b[2] - a[2]) * portable::cos(a[1]) * kRadius_m, north = (b[1] - a[1]) * kRadius_m;
  return portable::hypot(east, north, b[3] - a[3]) <= (speed + kMargin_m_s) * time + kMargin_m;
}

/// Records that could follow one another: nothing else marks an SBET.
bool is_sbet(std::string_view first_bytes) {
  constexpr std::size_t kMostJudged = 16;
  using Record = std::array<double, kSbetDoubles>;
  const std::size_t count = std::min(first_bytes.size() / sizeof(Record), kMostJudged);
  if (count < 2) return false;
  std::array<Record, kMostJudged> records{};
  std::memcpy(records.data(), first_bytes.data(), count * sizeof(Record));
  for (std::size_t i = 0; i < count; ++i)
    if (!impossible_sbet(records[i]).empty() || (i > 0 && !could_follow(records[i - 1], records[i]))) return false;
  return records[0][1] != 0 || records[0][2] != 0;
}

}  // namespace

constinit const DeviceType kSbet{.word = "sbet",
                                 .role = Role::Pos,
                                 .is_sheddable = false,
                                 .make = make_device<SbetDevice>,
                                 .files = {.log = {.format = "SBET", .ending = ".sbet", .is_beginning = is_sbet}},
                                 .solutions = "a record of the trajectory"};

}  // namespace hueline::drivers
