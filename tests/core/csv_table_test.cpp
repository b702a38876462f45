#include "core/csv_table.hpp"

#include <gtest/gtest.h>

#include <random>

namespace hueline {
namespace {

const CsvTable::Columns kColumns{
    .needed = {"name", "x_m"}, .allowed = {"lens", "count"}, .units = "(metres)", .advice = {}};

Result<CsvTable> parse(std::string_view text) { return CsvTable::parse(text, "t.csv", kColumns); }
std::string why(std::string_view text) {
  const auto table = parse(text);
  return table.ok() ? "" : table.error().message;
}

/// The same table in every form in which people's programs write it.
TEST(CsvTable, ReadsTheSameFromEveryFormOfTheSameTable) {
  for (const char* text : {"name,x_m,count\nA,1.5,3\nB,-2e1,\n", "name,x_m,count\r\nA,1.5,3\r\nB,-2e1,",
                           "\xEF\xBB\xBFname;x_m;count\nA;1.5;3\nB;-2e1;\n",
                           "# made by hand\n\n name , x_m\t,count\nA , 1.5,\t3\n#B,1,1\n   \nB,-2e1, \n",
                           "count,name,x_m\n3,A,1.5\n,B,-2e1\n", "count\tname\tx_m\n3\tA\t1.5\n\tB\t-2e1\r\n",
                           "name;x_m;count\nA;1,5;3\nB;-2e1;\n", "x_m\tname\tcount\n1,5\tA\t3\n-20\tB\t\n",
                           "\"name\",\"x_m\",\"count\"\r\n\"A\", \"1.5\" ,\"3\"\r\n\"B\",-2e1,\"\"\r\n"}) {
    const auto table = parse(text);
    ASSERT_TRUE(table.ok()) << text << table.error().message;
    ASSERT_EQ(table->rows(), 2u) << text;
    EXPECT_EQ(table->text(0, "name"), "A");
    EXPECT_EQ(*table->number(0, "x_m"), 1.5);
    EXPECT_EQ(*table->number(1, "x_m"), -20);
    EXPECT_EQ(*table->whole_number(0, "count"), 3u);
    EXPECT_EQ(*table->optional_number(0, "count").value(), 3);
    EXPECT_FALSE(*table->optional_number(1, "count"));
    EXPECT_FALSE(table->has("lens"));
    EXPECT_EQ(table->text(1, "lens"), "");
    EXPECT_FALSE(*table->optional_number(1, "lens"));
  }
}

TEST(CsvTable, RefusesWithFileLineAndReason) {
  EXPECT_EQ(why(""), "t.csv:1: no line that names the columns: name, x_m");
  EXPECT_EQ(why("# nothing\n\n"), "t.csv:2: no line that names the columns: name, x_m");
  EXPECT_EQ(why("name,x_m\n\n"), "t.csv:2: holds no rows");
  EXPECT_EQ(why("name,x_ft\n"), "t.csv:1: column 'x_ft' is unknown; allowed: name, x_m (metres), lens, count");
  EXPECT_EQ(why("name,x_m,name\n"), "t.csv:1: column 'name' is there twice");
  EXPECT_EQ(why("name,lens\n"), "t.csv:1: column 'x_m' is missing; the first line must name name, x_m");
  EXPECT_EQ(why("#\nname,x_m\nA,1,2\n"), "t.csv:3: 3 values, the first line names 2 columns");
  for (const char* row : {"\"A,1", "\"A\"B,1", "\"A\"\",1", "\"", "A,\"1"})
    EXPECT_EQ(why(std::string("name,x_m\n") + row + "\n"),
              "t.csv:2: a value in quotes does not end, or something stands behind it")
        << row;
  EXPECT_EQ(why(std::string_view("\xFF\xFEn\0a\0", 6)), "t.csv:1: the text is UTF-16; save it as UTF-8");
}

TEST(CsvTable, RefusesWhatIsNoNumber) {
  for (const char* word : {"", "one", "1.5 m", "0x10", "nan", "inf", "1e999", "+1", "--1", "1 000"}) {
    const auto table = parse(std::string("name,x_m\nA,1\nB,") + word + "\n");
    ASSERT_TRUE(table.ok()) << word;
    const auto value = table->number(1, "x_m");
    ASSERT_FALSE(value.ok()) << word;
    EXPECT_EQ(value.error().message, std::string("t.csv:3: x_m is '") + word + "', not a number");
    EXPECT_EQ(value.error().code, ErrorCode::Malformed);
  }
  // A comma may group digits where there are points, or where commas separate values and are therefore quoted.
  for (const char* text : {"name;x_m\nA;1,500\nB;1.5\n", "name,x_m\nA,\"1,500\"\n", "name;x_m\nA;1,500,000\n"})
    EXPECT_FALSE(parse(text)->number(0, "x_m").ok()) << text;
  const auto table = parse("name;x_m;count\nA;1,5;-1\nB;1.5;\n");
  ASSERT_TRUE(table.ok());
  EXPECT_EQ(table->number(0, "x_m").error().message,
            "t.csv:2: x_m is '1,5', not a number; decimals stand behind a point");
  EXPECT_EQ(table->whole_number(0, "count").error().message, "t.csv:2: count is '-1', not a whole number");
  EXPECT_EQ(table->refuse(0, "too much").message, "t.csv:2: too much");
}

TEST(CsvTable, TheCallerSaysWhatIsWrongWithAColumn) {
  CsvTable::Columns columns = kColumns;
  columns.advice = [](std::string_view name) {
    return name == "x_ft" ? std::string("column 'x_ft' is in feet") : std::string();
  };
  EXPECT_EQ(CsvTable::parse("name,x_ft\n", "t.csv", columns).error().message,
            "t.csv:1: column 'x_ft' is in feet; allowed: name, x_m (metres), lens, count");
  EXPECT_EQ(CsvTable::parse("name,y\n", "t.csv", columns).error().message,
            "t.csv:1: column 'y' is unknown; allowed: name, x_m (metres), lens, count");
}

TEST(CsvTable, NamesKeepTheirSeparatorsInQuotes) {
  for (const std::string name : {"A", "a, b", "a; b", "he said \"1, 2\"", "\"", ""}) {
    const auto table = parse("name,x_m\n" + csv_value(name) + ",7\n");
    ASSERT_TRUE(table.ok()) << name;
    EXPECT_EQ(table->text(0, "name"), name);
    EXPECT_EQ(*table->number(0, "x_m"), 7);
  }
  EXPECT_EQ(csv_value("A"), "A");
  EXPECT_EQ(parse("name;x_m\na, b;7\n")->text(0, "name"), "a, b");
}

/// Any bytes may be handed over as a table. Either they are one, or the error names the line.
TEST(CsvTable, SurvivesBrokenBytes) {
  std::mt19937 random(1);
  const std::string good = "\xEF\xBB\xBF# points\r\nname,x_m,lens,count\r\nA,1.5,l0,3\r\nB,2.5,l1,4\r\nC,-3,,\r\n";
  int read = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string text = good;
    if (i % 4 == 0) text.resize(random() % text.size());
    for (unsigned hit = random() % 4; hit > 0 && !text.empty(); --hit)
      text[random() % text.size()] = static_cast<char>(random());
    const auto table = parse(text);
    if (!table.ok()) {
      EXPECT_TRUE(table.error().message.starts_with("t.csv:")) << table.error().message;
      continue;
    }
    ++read;
    for (std::size_t row = 0; row < table->rows(); ++row)
      for (const char* column : {"name", "x_m", "lens", "count"}) {
        (void)table->optional_number(row, column).ok();
        (void)table->whole_number(row, column).ok();
      }
  }
  EXPECT_GT(read, 1000);
  EXPECT_LT(read, 19'000);
}

}  // namespace
}  // namespace hueline
