#include "core/packed_file.hpp"

#include <array>
#include <utility>

namespace hueline {

std::string how_to_unpack(std::string_view first_bytes) {
  using namespace std::string_view_literals;
  if (first_bytes.starts_with("version https://git-lfs"))
    return "is a pointer of Git LFS: get the file with git lfs pull";
  constexpr std::string_view kInstead =
      ", which is not read: give the scanner's datagrams in a capture file (pcap), or a recording of ROS";
  if (first_bytes.starts_with("livox_tech"))
    return "is a recording of Livox Viewer (.lvx, .lvx2)" + std::string(kInstead);
  if (first_bytes.size() > 8 && first_bytes.substr(8).starts_with("OSF$"))
    return "is a recording of Ouster's SDK (.osf)" + std::string(kInstead);
  // Of the second kind are those that a logger has not closed, as CANedge leaves them.
  if (first_bytes.starts_with("MDF     ") || first_bytes.starts_with("UnFinMF "))
    return "is a measurement file (MDF, .mf4), which is not read: make a CAN log of it with the logger's own converter "
           "(mdf2asc of CSS Electronics), or with can_logconvert FILE.mf4 FILE.asc of python-can, which needs asammdf";
  constexpr std::array programs{std::pair("\x1f\x8b"sv, "gunzip"sv), std::pair(kZstdMagic, "zstd -d"sv),
                                std::pair("\xfd\x37\x7a\x58"sv, "xz -d"sv), std::pair("BZh"sv, "bunzip2"sv),
                                std::pair("PK\x03\x04"sv, "unzip"sv)};
  for (const auto& [magic, program] : programs)
    if (first_bytes.starts_with(magic)) return "is compressed as a whole: unpack it with " + std::string(program);
  return {};
}

}  // namespace hueline
