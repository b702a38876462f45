#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hueline::storage {

/// A TrueType font, of which a document needs a few characters. The font is a part of the program and therefore
/// trusted: what is not as the format says throws std::out_of_range. Characters beyond U+FFFF are not looked for.
/// See the OpenType specification, chapters cmap, glyf, loca, hmtx.
class TrueTypeFont {
 public:
  using Glyph = std::uint16_t;

  /// `file` must outlive this object.
  explicit TrueTypeFont(std::string_view file);

  /// Returns the glyph of a character; 0 if the font has none.
  Glyph glyph(char32_t code) const;
  /// Returns the width of a glyph in thousandths of the size.
  int width(Glyph glyph) const;
  int ascent() const { return per_mille(s16("hhea", 4)); }
  int descent() const { return per_mille(s16("hhea", 6)); }
  /// Returns left, bottom, right and top of all glyphs, in thousandths of the size.
  std::vector<int> box() const;

  /// Returns a font file that has only these glyphs, numbered 1, 2 and so on in their order behind the glyph 0 for
  /// missing characters, and what they are composed of. It has what a PDF needs, and no table of characters. The same
  /// glyphs give the same bytes.
  std::string subset(std::span<const Glyph> glyphs) const;

 private:
  std::string_view table(const std::string& name) const;
  std::uint16_t u16(const std::string& name, std::size_t at) const;
  int s16(const std::string& name, std::size_t at) const { return static_cast<std::int16_t>(u16(name, at)); }
  int per_mille(int units) const { return units * 1000 / u16("head", 18); }
  std::string_view outline(Glyph glyph) const;

  std::map<std::string, std::string_view> tables_;
  std::string_view characters_;  // of cmap: format 4, of Unicode's first plane
};

}  // namespace hueline::storage
