#include "storage/truetype_font.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace hueline::storage {
namespace {

// All numbers of the format are big endian.
std::uint16_t u16_at(std::string_view bytes, std::size_t at) {
  return static_cast<std::uint16_t>(static_cast<std::uint8_t>(bytes.at(at)) << 8 |
                                    static_cast<std::uint8_t>(bytes.at(at + 1)));
}
std::uint32_t u32_at(std::string_view bytes, std::size_t at) {
  return static_cast<std::uint32_t>(u16_at(bytes, at)) << 16 | u16_at(bytes, at + 2);
}
void append16(std::string& out, std::size_t value) {
  out += static_cast<char>(value >> 8 & 0xFF);
  out += static_cast<char>(value & 0xFF);
}
void append32(std::string& out, std::size_t value) {
  append16(out, value >> 16);
  append16(out, value);
}
void replace16(std::string& out, std::size_t at, std::size_t value) {
  out.at(at) = static_cast<char>(value >> 8 & 0xFF);
  out.at(at + 1) = static_cast<char>(value & 0xFF);
}

/// Returns the sum of the 32-bit words, the last filled with zeros: the format's check sum.
std::uint32_t sum(std::string_view bytes) {
  std::uint32_t out = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    out += static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes[i])) << (24 - 8 * (i % 4));
  return out;
}

/// Returns where the numbers of the components stand in the outline of a composite glyph; nothing for a simple one.
std::vector<std::size_t> components(std::string_view outline) {
  std::vector<std::size_t> out;
  if (outline.empty() || (u16_at(outline, 0) & 0x8000) == 0) return out;  // the number of contours is not negative
  constexpr unsigned kWords = 0x1, kScale = 0x8, kMore = 0x20, kTwoScales = 0x40, kMatrix = 0x80;
  unsigned flags = kMore;
  for (std::size_t at = 10; (flags & kMore) != 0;) {
    flags = u16_at(outline, at);
    out.push_back(at + 2);
    at += (flags & kWords) != 0 ? 8 : 6;
    at += (flags & kScale) != 0 ? 2 : (flags & kTwoScales) != 0 ? 4 : (flags & kMatrix) != 0 ? 8 : 0;
  }
  return out;
}

}  // namespace

TrueTypeFont::TrueTypeFont(std::string_view file) {
  const std::size_t count = u16_at(file, 4);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string_view entry = file.substr(12 + 16 * i, 16);
    tables_[std::string(entry.substr(0, 4))] = file.substr(u32_at(entry, 8), u32_at(entry, 12));
  }
  const std::string_view cmap = table("cmap");
  for (std::size_t i = 0; i < u16_at(cmap, 2); ++i) {
    const std::string_view one = cmap.substr(u32_at(cmap, 4 + 8 * i + 4));
    if (u16_at(cmap, 4 + 8 * i) == 3 && u16_at(one, 0) == 4) characters_ = one;
  }
  if (characters_.empty() || u16("head", 50) != 1) throw std::out_of_range("a font without Unicode or long offsets");
}

std::string_view TrueTypeFont::table(const std::string& name) const { return tables_.at(name); }
std::uint16_t TrueTypeFont::u16(const std::string& name, std::size_t at) const { return u16_at(table(name), at); }

TrueTypeFont::Glyph TrueTypeFont::glyph(char32_t code) const {
  if (code > 0xFFFF) return 0;
  const std::size_t twice = u16_at(characters_, 6);  // of the number of segments
  const std::size_t ends = 14, begins = ends + twice + 2, deltas = begins + twice, ranges = deltas + twice;
  std::size_t low = 0, high = twice / 2;  // the first segment that ends at the character or behind it
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (u16_at(characters_, ends + 2 * middle) < code)
      low = middle + 1;
    else
      high = middle;
  }
  const std::size_t at = 2 * low;
  if (at >= twice || u16_at(characters_, begins + at) > code) return 0;
  const unsigned delta = u16_at(characters_, deltas + at), range = u16_at(characters_, ranges + at);
  if (range == 0) return static_cast<Glyph>(code + delta);
  const Glyph found = u16_at(characters_, ranges + at + range + 2 * (code - u16_at(characters_, begins + at)));
  return found == 0 ? Glyph{0} : static_cast<Glyph>(found + delta);
}

int TrueTypeFont::width(Glyph glyph) const {
  const std::size_t last = u16("hhea", 34) - 1u;  // the glyphs behind have its width
  return per_mille(u16("hmtx", 4 * std::min<std::size_t>(glyph, last)));
}

std::vector<int> TrueTypeFont::box() const {
  std::vector<int> out;
  for (const std::size_t at : {36u, 38u, 40u, 42u}) out.push_back(per_mille(s16("head", at)));
  return out;
}

std::string_view TrueTypeFont::outline(Glyph glyph) const {
  const std::size_t begin = u32_at(table("loca"), 4u * glyph), end = u32_at(table("loca"), 4u * glyph + 4);
  return table("glyf").substr(begin, end - begin);
}

std::string TrueTypeFont::subset(std::span<const Glyph> glyphs) const {
  std::vector<Glyph> kept{0};
  kept.insert(kept.end(), glyphs.begin(), glyphs.end());
  std::string glyf, loca, hmtx;
  for (std::size_t i = 0; i < kept.size(); ++i) {  // components are added at the end meanwhile
    std::string shape(outline(kept[i]));
    for (const std::size_t at : components(shape)) {
      const Glyph part = u16_at(shape, at);
      const auto found = std::ranges::find(kept, part);
      replace16(shape, at, static_cast<std::size_t>(found - kept.begin()));
      if (found == kept.end()) kept.push_back(part);
    }
    append32(loca, glyf.size());
    glyf += shape;
    glyf.resize((glyf.size() + 3) / 4 * 4);
    const std::size_t last = u16("hhea", 34) - 1u;
    append16(hmtx, u16("hmtx", 4 * std::min<std::size_t>(kept[i], last)));
    append16(hmtx,
             kept[i] <= last ? u16("hmtx", 4u * kept[i] + 2) : u16("hmtx", 4 * (last + 1) + 2 * (kept[i] - last - 1)));
  }
  append32(loca, glyf.size());

  std::map<std::string, std::string> tables;  // in the order of their names, as the format wants it
  for (const char* name : {"cvt ", "fpgm", "prep", "head", "hhea", "maxp"})
    if (const auto found = tables_.find(name); found != tables_.end()) tables[name] = std::string(found->second);
  tables["glyf"] = std::move(glyf);
  tables["loca"] = std::move(loca);
  tables["hmtx"] = std::move(hmtx);
  tables["head"].replace(8, 4, 4, '\0');  // the check sum of the file
  replace16(tables["hhea"], 34, kept.size());
  replace16(tables["maxp"], 4, kept.size());

  std::size_t power = 1, log = 0;
  for (; power * 2 <= tables.size(); power *= 2) ++log;
  std::string out("\0\1\0\0", 4), body;
  append16(out, tables.size());
  append16(out, power * 16);
  append16(out, log);
  append16(out, (tables.size() - power) * 16);
  const std::size_t begin = 12 + 16 * tables.size();
  std::size_t head = 0;
  for (const auto& [name, bytes] : tables) {
    out += name;
    append32(out, sum(bytes));
    append32(out, begin + body.size());
    append32(out, bytes.size());
    if (name == "head") head = begin + body.size();
    body += bytes;
    body.resize((body.size() + 3) / 4 * 4);
  }
  out += body;
  std::string check;
  append32(check, 0xB1B0AFBAu - sum(out));
  return out.replace(head + 8, 4, check);
}

}  // namespace hueline::storage
