#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hueline::test {

/// An E57 file that is written by hand, after ASTM E2807-11: sections of points, then the description.
class SmallE57 {
 public:
  SmallE57() : content_(48, '\0') {}

  /// Adds a section whose packets are these and returns its place in the file.
  std::uint64_t section(const std::vector<std::string>& packets) {
    const std::uint64_t begin = content_.size();
    std::uint64_t length = 32;
    for (const std::string& one : packets) length += one.size();
    content_ += '\1';
    content_.append(7, '\0');
    put(content_, length);
    put(content_, place(begin + 32));
    put(content_, std::uint64_t{0});
    for (const std::string& one : packets) content_ += one;
    return place(begin);
  }

  /// Returns a packet of data with these streams.
  static std::string packet(const std::vector<std::string>& streams) {
    std::string lengths, bytes;
    for (const std::string& one : streams) {
      put(lengths, static_cast<std::uint16_t>(one.size()));
      bytes += one;
    }
    bytes = lengths + bytes;
    bytes.resize((bytes.size() + 6 + 3) / 4 * 4 - 6);
    std::string out{'\1', '\0'};
    put(out, static_cast<std::uint16_t>(bytes.size() + 5));
    put(out, static_cast<std::uint16_t>(streams.size()));
    return out + bytes;
  }
  /// Returns a packet that is an index or empty.
  static std::string other_packet(char kind) {
    std::string out{kind, '\0'};
    put(out, std::uint16_t{15});
    out.resize(16);
    return out;
  }

  template <class T>
  static std::string numbers(const std::vector<T>& values) {
    std::string out;
    for (const T value : values) put(out, value);
    return out;
  }
  /// Packs whole numbers of so many bits one behind the other, from the lowest bit on.
  static std::string packed(const std::vector<std::uint64_t>& values, unsigned bits) {
    std::string out;
    std::size_t at = 0;
    for (const std::uint64_t value : values)
      for (unsigned i = 0; i < bits; ++i, ++at) {
        if (at % 8 == 0) out += '\0';
        if (value >> i & 1) out.back() = static_cast<char>(out.back() | 1 << at % 8);
      }
    return out;
  }

  /// Returns the file with this description.
  std::string file(std::string_view xml) {
    const std::uint64_t begin = content_.size();
    content_ += xml;
    content_.resize((content_.size() + 1019) / 1020 * 1020);
    std::string head = "ASTM-E57";
    put(head, std::uint32_t{1});
    put(head, std::uint32_t{0});
    put(head, std::uint64_t{content_.size() / 1020 * 1024});
    put(head, place(begin));
    put(head, std::uint64_t{xml.size()});
    put(head, std::uint64_t{1024});
    content_.replace(0, head.size(), head);
    std::string out;
    for (std::size_t at = 0; at < content_.size(); at += 1020) {
      const std::string page = content_.substr(at, 1020);
      out += page;
      const std::uint32_t sum = castagnoli(page);
      for (const int shift : {24, 16, 8, 0}) out += static_cast<char>(sum >> shift);
    }
    return out;
  }

 private:
  template <class T>
  static void put(std::string& out, T value) {
    const auto bytes = std::bit_cast<std::array<char, sizeof value>>(value);
    out.append(bytes.data(), bytes.size());
  }
  static std::uint64_t place(std::uint64_t at) { return at / 1020 * 1024 + at % 1020; }
  /// Bit by bit: an independent check of the program's.
  static std::uint32_t castagnoli(std::string_view bytes) {
    std::uint32_t sum = 0xFFFFFFFF;
    for (const char byte : bytes) {
      sum ^= static_cast<std::uint8_t>(byte);
      for (int i = 0; i < 8; ++i) sum = sum >> 1 ^ (sum & 1 ? 0x82F63B78 : 0);
    }
    return ~sum;
  }

  std::string content_;
};

}  // namespace hueline::test
