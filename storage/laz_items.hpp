#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "storage/laz_chunk.hpp"
#include "storage/laz_layers.hpp"

/// The items of a LAZ point of the formats 0 to 3 (version 2 of POINT10, GPSTIME11, RGB12 and BYTE). A chunk has one
/// coder, and all items of a record are coded before the next record. As in storage/laz_layers.hpp, code() reads the
/// fields from the record with an encoder and writes them to the record with a decoder. Source: the published LASzip
/// format.
namespace hueline::storage::laz {

/// Where the fields of the formats 0 to 3 lie that do not lie where those of the formats 6 to 8 do.
constexpr std::size_t kOldClass = 15, kOldAngle = 16, kOldUser = 17, kOldSource = 18, kPoint10 = 20;

/// The contexts of a return: how it stands among the returns of its pulse. `count` and `number` are from 0 to 7; the
/// format knows pairs that make no sense, and a pair in the wrong order.
constexpr std::size_t old_return_context(std::size_t number, std::size_t count) {
  const std::size_t low = std::min(number, count), high = std::max(number, count);
  if (low == 0) return 15 - high;
  if (high <= 5) return high * (high - 1) / 2 + low - 1;
  return high == 6 ? low + 9 : low + 8;
}

/// Everything but time, colour and extra bytes.
class PointItem {
 public:
  template <class Coder, class Byte>
  void code(Coder& coder, Byte* record, const std::byte* last) {
    std::uint32_t change = 0;
    if constexpr (!Coder::kDecodes) change = change_of(record, last);
    change = coder.code(changes_, change);

    std::uint8_t returns = load<std::uint8_t>(last, kReturns);
    if (change & kReturnsChange) {
      SymbolModel& model = returns_[returns];
      returns = static_cast<std::uint8_t>(coder.code(model, load<std::uint8_t>(record, kReturns)));
    }
    store<Coder>(record, kReturns, returns);
    const std::size_t number = returns & 7u, count = returns >> 3 & 7u, context = old_return_context(number, count);

    std::uint16_t& intensity = intensities_[context];
    if (change & kIntensityChange)
      intensity = static_cast<std::uint16_t>(intensity_.code(coder, intensity, load<std::uint16_t>(record, kIntensity),
                                                             std::min<std::size_t>(context, 3)));
    store<Coder>(record, kIntensity, intensity);
    code_byte(coder, change & kClassChange, classes_, record, last, kOldClass);
    std::uint8_t angle = load<std::uint8_t>(last, kOldAngle);
    if (change & kAngleChange) {
      const auto step = static_cast<std::uint8_t>(load<std::uint8_t>(record, kOldAngle) - angle);
      angle = static_cast<std::uint8_t>(angle + coder.code(angles_[returns >> 6 & 1u], step));
    }
    store<Coder>(record, kOldAngle, angle);
    code_byte(coder, change & kUserChange, users_, record, last, kOldUser);
    std::int32_t source = load<std::uint16_t>(last, kOldSource);
    if (change & kSourceChange) source = source_.code(coder, source, load<std::uint16_t>(record, kOldSource), 0);
    store<Coder>(record, kOldSource, static_cast<std::uint16_t>(source));

    code_place(coder, record, last, context, count == 1 ? 1 : 0, number > count ? number - count : count - number);
  }

 private:
  enum Change : std::uint32_t {
    kSourceChange = 1,
    kUserChange = 2,
    kAngleChange = 4,
    kClassChange = 8,
    kIntensityChange = 16,
    kReturnsChange = 32
  };

  /// For the encoder: returns which fields change. The intensity is compared with that of the last such return.
  std::uint32_t change_of(const std::byte* record, const std::byte* last) const {
    const auto differs = [&](std::size_t at) { return record[at] != last[at]; };
    const auto returns = load<std::uint8_t>(record, kReturns);
    const std::uint16_t intensity = intensities_[old_return_context(returns & 7u, returns >> 3 & 7u)];
    return (differs(kReturns) ? kReturnsChange : 0u) |
           (load<std::uint16_t>(record, kIntensity) != intensity ? kIntensityChange : 0u) |
           (differs(kOldClass) ? kClassChange : 0u) | (differs(kOldAngle) ? kAngleChange : 0u) |
           (differs(kOldUser) ? kUserChange : 0u) |
           (differs(kOldSource) || differs(kOldSource + 1) ? kSourceChange : 0u);
  }

  template <class Coder, class Byte>
  static void code_byte(Coder& coder, bool has_changed, ContextModels& models, Byte* record, const std::byte* last,
                        std::size_t at) {
    auto value = load<std::uint8_t>(last, at);
    if (has_changed) value = static_cast<std::uint8_t>(coder.code(models[value], load<std::uint8_t>(record, at)));
    store<Coder>(record, at, value);
  }

  template <class Coder, class Byte>
  void code_place(Coder& coder, Byte* record, const std::byte* last, std::size_t context, std::size_t single,
                  std::size_t level) {
    code_axis(coder, x_, x_medians_[context], record, last, kX, single);
    code_axis(coder, y_, y_medians_[context], record, last, kY, single + (std::min(x_.width(), 20u) & ~1u));
    std::int32_t& height = heights_[level];
    height = z_.code(coder, height, load<std::int32_t>(record, kZ),
                     single + (std::min((x_.width() + y_.width()) / 2, 18u) & ~1u));
    store<Coder>(record, kZ, height);
  }

  SymbolModel changes_{64};
  ContextModels returns_{256, 256}, classes_{256, 256}, users_{256, 256};
  std::vector<SymbolModel> angles_ = std::vector(2, SymbolModel(256));  // by the direction of the scan
  IntegerModel intensity_{16, 4}, source_{16, 1}, x_{32, 2}, y_{32, 22}, z_{32, 20};
  std::array<std::uint16_t, 16> intensities_{};  // the last one of each context
  std::array<RunningMedian, 16> x_medians_, y_medians_;
  std::array<std::int32_t, 8> heights_{};
};

/// All items of the records of a chunk.
template <class Coder>
class Items {
 public:
  using Byte = std::conditional_t<Coder::kDecodes, std::byte, const std::byte>;

  explicit Items(const LazRecord& kind) : kind_(kind) {
    std::size_t at = kPoint10;
    if (kind.format & 1) time_ = std::exchange(at, at + 8);
    if (kind.format >= 2) colour_ = std::exchange(at, at + 6);
    for (; at < kind.size; ++at) bytes_.emplace_back(at);
  }

  /// Codes the `count` - 1 records behind the first one, which is known.
  void code(Coder& coder, Byte* first, std::size_t count) {
    if (time_ != 0) times_.begin(load<std::uint64_t>(first, time_));
    for (std::size_t i = 1; i < count; ++i) {
      Byte* const record = first + i * kind_.size;
      const std::byte* const last = record - kind_.size;
      point_.code(coder, record, last);
      if (time_ != 0) store<Coder>(record, time_, times_.code(coder, load<std::uint64_t>(record, time_)));
      if (colour_ != 0) colours_.code(coder, record, last, colour_);
      for (ByteLayer& byte : bytes_) byte.code(coder, record, last);
    }
  }

 private:
  LazRecord kind_;
  std::size_t time_ = 0, colour_ = 0;  // where they begin in a record; 0: it has none
  PointItem point_;
  TimeModel times_{true};
  ColourModel colours_;
  std::vector<ByteLayer> bytes_;
};

}  // namespace hueline::storage::laz
