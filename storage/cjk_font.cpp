#include "storage/cjk_font.hpp"

#include <cstddef>

// The assembler puts the file into the program. HUELINE_CJK_FONT is its path where the program is built.
asm(".pushsection .rodata\n"
    ".balign 16\n"
    ".global hueline_cjk_font\n"
    "hueline_cjk_font:\n"
    ".incbin \"" HUELINE_CJK_FONT
    "\"\n"
    ".global hueline_cjk_font_end\n"
    "hueline_cjk_font_end:\n"
    ".popsection\n");
extern "C" {
extern const char hueline_cjk_font[], hueline_cjk_font_end[];
}

namespace hueline::storage {

std::string_view cjk_font() {
  return {hueline_cjk_font, static_cast<std::size_t>(hueline_cjk_font_end - hueline_cjk_font)};
}

}  // namespace hueline::storage
