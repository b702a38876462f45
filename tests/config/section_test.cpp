#include "config/section.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hueline::config {
namespace {

using ::testing::HasSubstr;

template <class F>
std::string message_of(F read) {
  try {
    read();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Section, ReadsWhatIsThere) {
  Section s =
      Section::load_text("port: 2368\nrate: 0.5\nname: front\non: true\nat: [1, 2, 3]\nsub: {a: 1}\n", "rig.yaml");
  EXPECT_EQ(s.integer("port", {1, 65535}), 2368);
  EXPECT_DOUBLE_EQ(s.number("rate", {0, 1}), 0.5);
  EXPECT_EQ(s.text("name"), "front");
  EXPECT_TRUE(s.boolean("on", false));
  EXPECT_EQ(s.numbers("at", {-10, 10}, "m", {3, 3}), (std::vector<double>{1, 2, 3}));
  Section sub = s.section("sub");
  EXPECT_EQ(sub.integer("a", {0, 9}), 1);
  sub.finish();
  EXPECT_EQ(s.number("absent", {0, 9}, 4.0), 4.0);
  s.finish();
}

TEST(Section, NamesFileLineKeyAndRangeWhenOutOfRange) {
  Section s = Section::load_text("# rig\nudp:\n  port: 70000\n", "rig.yaml");
  const std::string said = message_of([&] { s.section("udp").integer("port", {1, 65535}); });
  EXPECT_THAT(said, HasSubstr("rig.yaml:3"));
  EXPECT_THAT(said, HasSubstr("'udp.port'"));
  EXPECT_THAT(said, HasSubstr("'70000'"));
  EXPECT_THAT(said, HasSubstr("from 1 to 65535"));
}

TEST(Section, SaysWhichKeyWasProbablyMeant) {
  EXPECT_THAT(message_of([] {
                Section::load_text("position_mm: [1, 2, 3]\n", "r").numbers("position_m", {-9, 9});
              }),
              HasSubstr("'position_m' is missing; is 'position_mm' meant for it?"));
  EXPECT_THAT(message_of([] { Section::load_text("port: COM3\nbaud: 9600\n", "r").text("device"); }),
              HasSubstr("'device' is missing; here are: port, baud"));
  EXPECT_THAT(message_of([] {
                Section s = Section::load_text("prot: 2\n", "r");
                s.has("port");
                s.finish();
              }),
              HasSubstr("'prot' is not known (did you mean port?); known here: port"));
}

TEST(Section, TakesOneOfKeysThatExcludeEachOther) {
  EXPECT_EQ(Section::load_text("b: 1\nc: 2\n", "r").one_of({"a", "b"}), "b");
  EXPECT_EQ(Section::load_text("c: 2\n", "r").one_of({"a", "b"}, "a"), "a");
  EXPECT_THAT(message_of([] {
                Section::load_text("port: COM3\n", "r").one_of({"tcp", "serial"});
              }),
              HasSubstr("give exactly one of tcp, serial; here are: port"));
  EXPECT_THAT(message_of([] {
                Section::load_text("tcp: 1\nserial: 2\n", "r").one_of({"tcp", "serial"});
              }),
              HasSubstr("here are tcp and serial"));
}

TEST(Section, RefusesASecondDocument) {
  EXPECT_THAT(message_of([] { Section::load_text("a: 1\n---\n# more\nb: 2\n", "r"); }),
              HasSubstr("r:4: a second document begins here, behind a line ---"));
  EXPECT_THAT(message_of([] { Section::load_text("a: 1\n---\nb: [2\n", "r"); }), HasSubstr("not YAML"));
  EXPECT_EQ(Section::load_text("%YAML 1.2\n---\na: 1\n---\n# nothing\n...\n", "r").integer("a", {0, 9}), 1);
}

TEST(Section, RefusesUnknownMissingDoubleAndMistyped) {
  EXPECT_THAT(message_of([] {
                Section s = Section::load_text("a: 1\nprot: 2\n", "r");
                s.integer("a", {0, 9});
                s.has("port");
                s.finish();
              }),
              ::testing::AllOf(HasSubstr("r:2"), HasSubstr("'prot' is not known"), HasSubstr("a, port")));
  EXPECT_THAT(message_of([] {
                Section::load_text("a: 1\n", "r").integer("port", {0, 9});
              }),
              HasSubstr("'port' is missing"));
  EXPECT_THAT(message_of([] { Section::load_text("a: 1\na: 2\n", "r"); }), HasSubstr("stands twice"));
  EXPECT_THAT(message_of([] { Section::load_text("a: [1, x]\n", "r").numbers("a", {0, 9}); }), HasSubstr("'x'"));
  EXPECT_THAT(message_of([] { Section::load_text("a: 1.5\n", "r").integer("a", {0, 9}); }), HasSubstr("whole number"));
  EXPECT_THAT(message_of([] {
                Section::load_text("a: [1, 1.5]\n", "r").numbers("a", {0, 9}, "", {}, true);
              }),
              HasSubstr("whole number"));
  EXPECT_THAT(message_of([] {
                Section::load_text("a: [1, 10]\n", "r").numbers("a", {0, 9}, "", {}, true);
              }),
              HasSubstr("from 0 to 9"));
  EXPECT_THAT(message_of([] {
                Section::load_text("a: [1, 2]\n", "r").numbers("a", {0, 9}, "m", {3, 3});
              }),
              HasSubstr("'a' is a list of 2; allowed: a list of 3 numbers"));
  EXPECT_THAT(message_of([] {
                Section::load_text("a: 360\n", "r").number("a", {0, 360, Ends::MinOnly}, "deg");
              }),
              HasSubstr("'a' is '360'; allowed: a number from 0 to below 360 deg"));
  EXPECT_THAT(message_of([] { Section::load_text("a: [x, [y]]\n", "r").texts("a"); }),
              HasSubstr("'a' is a list of 1; allowed: a list, each of its items a text"));
  EXPECT_THAT(message_of([] { Section::load_text("a: nan\n", "r").number("a", {0, 9}); }), HasSubstr("allowed"));
  EXPECT_THAT(message_of([] { Section::load_text("a: [1\n", "r"); }), HasSubstr("not YAML"));
  EXPECT_THAT(message_of([] { Section::load_text("- 1\n", "r"); }), HasSubstr("expected a mapping"));
  EXPECT_THAT(message_of([] { Section::load_file("/nowhere/rig.yaml"); }), HasSubstr("cannot be read"));
  EXPECT_THAT(message_of([] { Section::load_file("/dev/zero"); }), HasSubstr("is a device, not a file"));
  EXPECT_THAT(message_of([] {
                Section::load_text("m: VLP-61\n", "r").choice<int>("m", {{"VLP-16", 1}, {"HDL-32E", 2}});
              }),
              HasSubstr("one of: VLP-16, HDL-32E"));
}

}  // namespace
}  // namespace hueline::config
