#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>

#include "tests/support/pcap_writer.hpp"

namespace hueline::test {

/// Writes packets of RoboSense scanners, from the maker's manuals. It shares no code with the decoder.
struct RobosensePoints {
  bool is_helios = false;
  std::array<unsigned, 3> type{0, 1, 0};  // the bytes 30 to 32
  Bytes time = ByteWriter(true).u8(23).u8(11).u8(14).u8(22).u8(13).u8(20).u16(250).u16(125).bytes();
  /// In 0.01 deg.
  std::function<unsigned(unsigned block)> azimuth = [](unsigned block) { return 1000 + 40 * block; };
  std::function<unsigned(unsigned block, unsigned channel)> range = [](unsigned, unsigned) { return 2000u; };

  Bytes bytes() const {
    ByteWriter out(true);
    out.u8(0x55).u8(0xAA).u8(0x05).u8(is_helios ? 0x5A : 0x0A);
    if (is_helios)
      out.zeros(4);
    else
      out.u8(0x5A).u8(0xA5).u8(0x50).u8(0xA0);
    out.zeros(12).raw(time).u8(type[0]).u8(type[1]).u8(type[2]).zeros(9);
    for (unsigned block = 0; block < 12; ++block) {
      out.u16(0xFFEE).u16(azimuth(block));
      for (unsigned channel = 0; channel < 32; ++channel) out.u16(range(block, channel)).u8(10 + channel);
    }
    return out.u32(0).u16(0x00FF).bytes();
  }
};

struct RobosenseDifop {
  unsigned rpm = 600, first = 0, last = 36000, returns = 1, sync = 0, gps = 0, reversed = 0;
  /// In the unit of the model: elevation and azimuth of a beam.
  std::function<int(unsigned beam)> elevation = [](unsigned beam) { return 100 * static_cast<int>(beam); };
  std::function<int(unsigned beam)> azimuth = [](unsigned) { return 0; };
  unsigned beams = 32;
  bool is_rs16 = false;

  Bytes bytes() const {
    ByteWriter out(true);
    out.u32(0xA5FF005A).u32(0x11115555).u16(rpm).zeros(22).u16(first).u16(last).zeros(264).u8(returns);
    out.u8(0).u8(sync).zeros(34).u8(reversed).zeros(19).u8(gps).zeros(110);
    const auto angle = [&](int value, bool is_there) {
      out.u8(!is_there   ? 0xFF
             : value < 0 ? 1
                         : 0)
          .u16(is_there ? static_cast<unsigned>(value < 0 ? -value : value) : 0xFFFF);
    };
    if (is_rs16) {
      out.zeros(697);
      for (unsigned beam = 0; beam < 16; ++beam) {
        const auto value = static_cast<unsigned>(std::abs(elevation(beam)));
        out.u8(value >> 16).u16(value & 0xFFFF);
      }
      return out.zeros(33).u16(0x0FF0).bytes();
    }
    for (unsigned beam = 0; beam < 32; ++beam) angle(elevation(beam), beam < beams);
    for (unsigned beam = 0; beam < 32; ++beam) angle(azimuth(beam), beam < beams);
    return out.zeros(586).u16(0x0FF0).bytes();
  }
};

}  // namespace hueline::test
