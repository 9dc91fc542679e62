// SPDX-License-Identifier: Apache-2.0
#include "base/toml_file.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "base/error.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage {
namespace {

constexpr std::array<Choice<int>, 2> kColours{{{"red", 1}, {"blue", 2}}};

// What is said of a file, without its folder; empty when it is taken.
std::string refusal(const std::string& text, const std::function<void(TomlSection&)>& read) {
  const ScratchFolder folder;
  try {
    const toml::table table = parse_toml(folder.write("a.toml", text), "a file (TOML)");
    TomlSection root(folder.at("a.toml"), &table, "");
    TomlSection section = root.section("part");
    root.finish();
    read(section);
    section.finish();
  } catch (const UserError& error) {
    const std::string what = error.what();
    return what.substr(what.find("a.toml"));
  }
  return "";
}

TEST(TomlFile, GivesWhatItHoldsAndElseTheFallback) {
  const auto read = [](TomlSection& part) {
    EXPECT_EQ(part.number("number", 0.0, -1.0, 10.0), 2.0);
    EXPECT_EQ(part.number("other_number", 0.5, -1.0, 1.0), 0.5);
    EXPECT_EQ(part.integer("integer", 0, INT64_MIN, INT64_MAX), INT64_MAX);
    EXPECT_TRUE(part.flag("flag", false));
    EXPECT_EQ(part.text("text", ""), "red");
    EXPECT_EQ(part.choice("text", "blue", kColours), 1);
    EXPECT_EQ(part.choice("colour", "blue", kColours), 2);
    EXPECT_EQ(part.texts("texts"), (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(part.rows("rows", 3), (std::vector<std::vector<unsigned>>{{0, 3}, {1}}));
    EXPECT_TRUE(part.texts("other_texts").empty());
    EXPECT_FALSE(part.has("other_texts"));
  };
  EXPECT_EQ(refusal("[part]\nnumber = 2\ninteger = 9223372036854775807\nflag = true\ntext = 'red'\n"
                    "texts = ['a', \"b\"]\nrows = [[0, 3], [1]]\n",
                    read),
            "");
}

TEST(TomlFile, NamesPlaceFoundAndExpected) {
  const auto number = [](TomlSection& part) { part.number("a", 0.0, 1.0, 2.0); };
  EXPECT_EQ(refusal("[part]\na = 3\n", number), "a.toml:2:5: part.a: found 3, expected 1 to 2");
  EXPECT_EQ(refusal("[part]\na = nan\n", number), "a.toml:2:5: part.a: found nan, expected 1 to 2");
  EXPECT_EQ(refusal("[part]\na = 9223372036854775807\n", number),
            "a.toml:2:5: part.a: found 9223372036854775807, expected 1 to 2");
  EXPECT_EQ(refusal("[part]\na = 'b'\n", number),
            "a.toml:2:5: part.a: found \"b\", expected a number from 1 to 2");
  EXPECT_EQ(refusal("[part]\na = true\n", number),
            "a.toml:2:5: part.a: found true, expected a number from 1 to 2");
  EXPECT_EQ(refusal("[part]\na = 2020-01-01\n", number),
            "a.toml:2:5: part.a: found a date or time, expected a number from 1 to 2");
  const auto integer = [](TomlSection& part) { part.integer("a", 0, 1, 2); };
  EXPECT_EQ(refusal("[part]\na = 1.0\n", integer),
            "a.toml:2:5: part.a: found 1.0, expected a whole number from 1 to 2");
  EXPECT_EQ(refusal("[part]\na = 3\n", integer), "a.toml:2:5: part.a: found 3, expected 1 to 2");
  EXPECT_EQ(refusal("[part]\na = 1\n", [](TomlSection& part) { part.flag("a", true); }),
            "a.toml:2:5: part.a: found 1, expected true or false");
  const auto text = [](TomlSection& part) { part.text("a", ""); };
  EXPECT_EQ(refusal("[part]\na = []\n", text), "a.toml:2:5: part.a: found a list, expected a text in quotes");
  EXPECT_EQ(refusal("[part]\na = \"\\u001b\"\n", text),
            "a.toml:2:5: part.a: found \"\\x1B\", expected a text without control characters");
  EXPECT_EQ(refusal("[part]\na = 'green'\n", [](TomlSection& part) { part.choice("a", "red", kColours); }),
            "a.toml:2:5: part.a: found \"green\", expected one of: red, blue");
  const auto texts = [](TomlSection& part) { part.texts("a"); };
  EXPECT_EQ(refusal("[part]\na = 'b'\n", texts),
            "a.toml:2:5: part.a: found \"b\", expected a list of texts in quotes");
  EXPECT_EQ(refusal("[part]\na = ['b', 1]\n", texts),
            "a.toml:2:11: part.a: found 1, expected a text in quotes");
  const auto rows = [](TomlSection& part) { part.rows("a", 2); };
  EXPECT_EQ(refusal("[part]\na = [1]\n", rows),
            "a.toml:2:6: part.a: found 1, expected a list of whole numbers from 0 to 2");
  EXPECT_EQ(refusal("[part]\na = [[]]\n", rows),
            "a.toml:2:6: part.a: found an empty list, expected a list of whole numbers from 0 to 2");
  EXPECT_EQ(refusal("[part]\na = [[1, 3]]\n", rows),
            "a.toml:2:10: part.a: found 3, expected whole numbers from 0 to 2");
}

TEST(TomlFile, NamesKeysThatNobodyAskedFor) {
  const auto read = [](TomlSection& part) {
    part.flag("b", true);
    part.flag("a", true);
  };
  EXPECT_EQ(refusal("[part]\nc = 3\n", read),
            "a.toml:2:5: part.c: found an unknown key, expected one of: a, b");
  EXPECT_EQ(refusal("[port]\n", read), "a.toml:1:1: port: found an unknown key, expected one of: part");
}

TEST(TomlFile, NamesTheSectionThatLacksAKey) {
  const auto read = [](TomlSection& part) { part.fail("a", "nothing", "a name"); };
  EXPECT_EQ(refusal("\n[part]\n", read), "a.toml:2:1: part.a: found nothing, expected a name");
}

TEST(TomlFile, RefusesWhatIsNoTomlFile) {
  const auto nothing = [](TomlSection&) {};
  EXPECT_EQ(refusal("", nothing), "a.toml: is empty, expected a file (TOML)");
  EXPECT_EQ(refusal("[part]\na = tru\n", nothing).substr(0, 16), "a.toml:2:8: not ");
  EXPECT_EQ(refusal("part = 1\n", nothing), "a.toml:1:8: part: found 1, expected a section [part]");
  EXPECT_THROW(parse_toml("/dev/zero", "a file"), UserError);
  EXPECT_THROW(parse_toml("/nowhere/a.toml", "a file"), UserError);
}

}  // namespace
}  // namespace meltstage
