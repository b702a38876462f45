#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

/// The differences between the Hesai models. Sources: the makers' user manuals of Pandar40P, Pandar64, PandarQT, QT128,
/// PandarXT, XT32M2X, OT128 and Pandar128, and the tables of their program HesaiLidar_SDK_2.0. All models have the same
/// idea of a data packet, little endian: a header (the Pandar40P has none), blocks of one azimuth each with a unit a
/// channel, and a tail. In dual-return mode two blocks in a row are the returns of the same firings; in triple-return
/// mode three.
///
///   header of 12 bytes (Pandar64: of 8)
///        0     2  0xEE 0xFF
///        2     2  version of the protocol (Pandar64: absent)
///        4     1  version of the status: a Pandar128 has less than 128, an OT128 to 136, a JT128 from 137 on
///        6     1  number of channels (Pandar64: at 2)
///        7     1  number of blocks (Pandar64: at 3)
///        9     1  step of the distance, mm (Pandar64: at 5)
///
///   block
///        0     2  flag 0xFF 0xEE, of the Pandar40P only
///        0     2  azimuth, 0.01 degrees
///        2        units: distance, 2 bytes; reflectivity; of some models one byte more. A distance below 4 steps is
///                 no return (of an OT128: 0 the channel did not fire, 1 and 2 something is too near, 3 nothing came)
///
/// The head turns on while the channels of a block fire one after the other: a channel looks to the azimuth of the
/// block, plus its own, plus the speed of the motor times its firing's time after that of the block.
namespace hueline::drivers {

/// In the order of hesai_tables().
enum class HesaiModel : std::uint8_t { Pandar40P, Pandar64, Qt64, Qt128, Xt16, Xt32, Xt32m2, Ot128, Pandar128 };

/// The direction of one beam.
struct HesaiBeam {
  double elevation_deg = 0;
  double azimuth_deg = 0;  ///< against that of the head when it fires, clockwise seen from above
};

/// Where the fields of the tail are, in bytes from its beginning.
struct HesaiTail {
  std::size_t bytes;         ///< that every packet has
  std::size_t mode;          ///< return mode, 1 byte
  std::size_t speed;         ///< of the motor, 2 bytes, 1/min
  std::size_t date;          ///< UTC: year, month, day, hour, minute, second
  std::size_t microseconds;  ///< of the UTC second, 4 bytes
  std::size_t sequence;      ///< number of the packet, 4 bytes; absent in packets without room for it
  std::size_t before = 0;    ///< bytes between the blocks and the tail: checksum, functional safety
};

/// The constants of one model.
struct HesaiTable {
  HesaiModel model;
  const char* name;
  /// A word in the names of the model's calibration files, in small letters and without - and _. The longest counts.
  const char* file_word;
  std::size_t head;  ///< bytes before the first block
  std::size_t flag;  ///< bytes of a block before its azimuth
  int blocks;
  std::size_t unit;  ///< bytes
  /// Of the header's version of the status, where it tells models with the same packets apart.
  std::uint8_t least_status = 0, most_status = 255;
  HesaiTail tail;
  bool has_short_year = false;  ///< the year counts from 2000, otherwise from 1900
  std::int32_t block_period;    ///< ns
  /// The same in high resolution: each channel fires in every second block of it, at its time less this period if it
  /// is later. 0: the model does not have it.
  std::int32_t fine_period = 0;
  /// Time of the packet's last block, ns after the packet's time; or that of its first block, if the maker counts from
  /// there. The other is 0.
  std::int32_t last_block = 0, first_block = 0;
  std::span<const HesaiBeam> beams;               ///< by channel
  std::span<const std::int32_t> times;            ///< of the firings, ns after the block's time
  std::span<const std::int32_t> times_of_second;  ///< those of every second block, if they differ

  constexpr int channels() const { return static_cast<int>(beams.size()); }
  constexpr std::size_t block_bytes() const { return flag + 2 + unit * beams.size(); }
  constexpr std::size_t tail_at() const {
    return head + block_bytes() * static_cast<std::size_t>(blocks) + tail.before;
  }
  constexpr std::size_t least_bytes() const { return tail_at() + tail.bytes; }
};

/// All models, in the order of HesaiModel.
std::span<const HesaiTable> hesai_tables();
const HesaiTable& hesai_table(HesaiModel model);

}  // namespace hueline::drivers
