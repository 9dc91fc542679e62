// SPDX-License-Identifier: Apache-2.0
#include "base/toml_text.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

// Empty when the text is taken.
std::string toml_refusal(std::string_view text) {
  const ScratchFolder folder;
  try {
    EXPECT_EQ(read_toml_text(folder.write("job.toml", text), "a job file"), text);
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

TEST(TomlText, PassesWhatPeopleWrite) {
  EXPECT_EQ(toml_refusal("[a.b]\nc.d = 1.5 # a comment ]]]\ne = [[1.5, 2.5], [3, 4]]\nf = {g.h = \"[[[\"}\n"),
            "");
  EXPECT_EQ(
      toml_refusal("a = \"...\\\"....\"\nb = '[[.\\'\nc = \"\"\"\n[[[\"\" . . \n\"\"\"\nd = '''\n.'''\n"),
      "");
  EXPECT_EQ(toml_refusal("a = \"no end\n[b]\n"), "");  // the parser tells
  EXPECT_EQ(toml_refusal("a = \"\\"), "");
  EXPECT_EQ(toml_refusal("a = '''"), "");
  std::string dots_in_strings;
  for (int i = 0; i < 1000; ++i)
    dots_in_strings += "a" + std::to_string(i) + " = \"" + std::string(100, '.') + "\"\n";
  EXPECT_EQ(toml_refusal(dots_in_strings), "");
}

TEST(TomlText, RefusesWhatTheParserHasNoDefinedAnswerFor) {
  using namespace std::string_view_literals;
  EXPECT_THAT(toml_refusal("\x89PNG\r\n\x1A\n\0"sv),
              EndsWith("job.toml: found a PNG image, expected a job file"));
  EXPECT_THAT(toml_refusal("<!DOCTYPE html>\n<p>\u00E9"),
              EndsWith("job.toml: found an HTML page, expected a job file"));
  EXPECT_THAT(
      toml_refusal("a = \"\"\"b \\ \n\t\u00E9\"\"\"\n"),
      EndsWith("job.toml:2:2: found a character beyond ASCII right behind a backslash, expected it on the "
               "line of the text before"));
  EXPECT_THAT(toml_refusal("a = \"\"\"\\\u00E9\"\"\"\n"),
              HasSubstr("job.toml:1:9: found a character beyond"));
  EXPECT_EQ(toml_refusal("a = \"\"\"\u00E9\\\\\n\u00E9 \\\n\\n\u00E9\\\n\"\"\"\n"), "");
  // a value without quotes goes on over quotes
  for (const std::string_view value : {"2[\'\u00E9\'", "2=\'\u00E9\'", "[1, 2=\'\u00E9\'", "2.\"\u00E9\""})
    EXPECT_THAT(toml_refusal("a = " + std::string(value)), HasSubstr("found a character beyond")) << value;
  EXPECT_EQ(
      toml_refusal("a.\"\u00E9\" = [\"\u00E9\", \'\u00E9\']\nb = {\"\u00E9\" = 1, c.\"\u00E9\" = \'[\'}\n"),
      "");
  // a date goes on behind a blank
  EXPECT_THAT(toml_refusal("a = 2026-11-2_7 0}\"\u00E9"),
              HasSubstr("job.toml:1:20: found a character beyond"));
  EXPECT_THAT(toml_refusal("a = 2026-11-27 0#\u00E9"), HasSubstr("job.toml:1:18: found a character beyond"));
  EXPECT_EQ(toml_refusal("a = 2026-11-27 # \u00E9\nb = 1 \nc = \"\u00E9\"\n"), "");
  // a block may end with two quotes of its own
  EXPECT_THAT(toml_refusal("a = \'\'\'b\'\'\'\'\u00E9\'\n"), HasSubstr("found a character beyond"));
  EXPECT_EQ(toml_refusal("a = \'\'\'\u00E9\'\'\'\'\'\nb = \"\"\"\u00E9\"\"\"\"\n"), "");
  EXPECT_EQ(toml_refusal("a = \"\\\u00E9\"\n"), "");  // the parser says that this is no escape
  EXPECT_THAT(toml_refusal("a = 1\n\xEF\xB7\xBF\n"),
              EndsWith("job.toml:2:1: found a character beyond ASCII outside quotes, expected it in quotes"));
  EXPECT_EQ(toml_refusal("\xEF\xBB\xBF\"µ\" = 'µ' # µ \xEF\xB7\xBF\n"), "");
}

TEST(TomlText, RefusesNestingThatWouldOverflowTheParser) {
  std::string dots = "x = 1\na";
  for (int i = 0; i < 300'000; ++i) dots += ".a";
  EXPECT_THAT(toml_refusal(dots + " = 1\n"),
              EndsWith("job.toml:2:130: found a key of more than 64 parts, expected SECTION.FIELD"));
  EXPECT_THAT(toml_refusal("[" + dots.substr(6) + "]\n"), HasSubstr("a key of more than 64 parts"));
  std::string quoted = "a";
  for (int i = 0; i < 300'000; ++i) quoted += " . 'a'";
  EXPECT_THAT(toml_refusal(quoted + " = 1\n"), HasSubstr("a key of more than 64 parts"));
  EXPECT_THAT(toml_refusal("a = " + std::string(1000, '[')),
              EndsWith("job.toml:1:69: found more than 64 brackets in each other, expected flatter values"));
  std::string tables = "a = ";
  for (int i = 0; i < 1000; ++i) tables += "{a=";
  EXPECT_THAT(toml_refusal(tables), HasSubstr("more than 64 brackets"));
}

}  // namespace
}  // namespace meltstage
