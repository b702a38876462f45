#include "core/printable.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/fault.hpp"

namespace hueline {
namespace {

TEST(Printable, LeavesTextAsItIs) {
  for (const char* text :
       {"", "<ERROR:Invalid Message. Field = 1>", "a tab is escaped, a \\ is not", "Zähler 23 °C, 10 µs, 測定, 🚗"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, EscapesWhatSteersATerminal) {
  EXPECT_EQ(printable("\x1b[2J\x1b]0;owned\x07"), "\\x1b[2J\\x1b]0;owned\\x07");
  EXPECT_EQ(printable("one\r\ntwo\tthree\x7f"), "one\\r\\ntwo\\tthree\\x7f");
  EXPECT_EQ(printable("one\ntwo\r", LineEnds::Keep), "one\ntwo\\r");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\u{9b}31m")
      << "CSI as one character";
  EXPECT_EQ(printable("\xe2\x80\xae"
                      "txt.exe"),
            "\\u{202e}txt.exe")
      << "from right to left";
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
}

TEST(Printable, EscapesWhatIsNoUtf8) {
  EXPECT_EQ(printable("23 \xb0"
                      "C"),
            "23 \\xb0C")
      << "Latin-1";
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf") << "longer than it must be";
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "a surrogate";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "above U+10FFFF";
  EXPECT_EQ(printable("\xe6\xb8"), "\\xe6\\xb8") << "cut off";
  EXPECT_EQ(printable("\xe6"
                      "a"),
            "\\xe6"
            "a");
}

/// Counts the code points of text that must be UTF-8 in another way than the function does: by the number of
/// continuation bytes that a lead byte announces.
bool is_safe(const std::string& text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i++]);
    if (lead < 0x20 || lead == 0x7f || (lead >= 0x80 && lead < 0xc2) || lead > 0xf4) return false;
    const int more = lead < 0x80 ? 0 : lead < 0xe0 ? 1 : lead < 0xf0 ? 2 : 3;
    for (int k = 0; k < more; ++k)
      if (i == text.size() || (static_cast<unsigned char>(text[i++]) & 0xc0) != 0x80) return false;
    if (lead == 0xc2 && static_cast<unsigned char>(text[i - 1]) < 0xa0) return false;
  }
  return true;
}

TEST(Printable, MakesAnythingSafeAndOnlyOnce) {
  std::mt19937 random(10);
  const std::string_view parts[] = {"text",     "\x1b[", "\xc3\xa4", "\xc3", "\xe2\x80\xae", "\xf0\x9f\x9a\x97",
                                    "\xf0\x9f", "\xff",  "\n",       "\\x",  "\xc2\x85",     "\xed\xbf\xbf"};
  for (int i = 0; i < 20'000; ++i) {
    std::string text;
    for (auto k = random() % 12; k > 0; --k) {
      if (random() % 2)
        text += parts[random() % std::size(parts)];
      else
        text += static_cast<char>(random());
    }
    const std::string shown = printable(text);
    ASSERT_TRUE(is_safe(shown)) << i;
    ASSERT_EQ(printable(shown), shown) << i;
    // A fault with this text passes through the journal and becomes safe, also if an older program recorded it
    // unchanged.
    auto bytes = encode_fault({1, FaultKind::Refused, {}, 1, text});
    ASSERT_EQ(decode_fault(1, {}, bytes)->detail, shown);
    bytes.resize(9);
    for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
    ASSERT_EQ(decode_fault(1, {}, bytes)->detail, shown);
  }
}

TEST(AsMarkup, WritesOutWhatHtmlAndXmlTakeForMarkup) {
  EXPECT_EQ(as_markup("<b>\"Bäume\" & Häuser</b>"), "&lt;b&gt;&quot;Bäume&quot; &amp; Häuser&lt;/b&gt;");
  EXPECT_EQ(as_markup("&lt;"), "&amp;lt;") << "text that is markup already is text like any other";
}

TEST(PercentEncoded, LeavesWhatAddressesMayHave) {
  EXPECT_EQ(percent_encoded("a b/ä+~.txt", true), "a%20b/%C3%A4%2B~.txt");
  EXPECT_EQ(percent_encoded("a/b=&", false), "a%2Fb%3D%26");
  EXPECT_EQ(percent_decoded("a%20b/%C3%a4%2B~"), "a b/ä+~");
  EXPECT_EQ(percent_decoded("%zz%2%%41%"), "%zz%2%A%");
}

}  // namespace
}  // namespace hueline
