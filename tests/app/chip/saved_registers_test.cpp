// SPDX-License-Identifier: Apache-2.0
// The file of `chip save` without a chip: what is written is read again, and nothing else is.
#include "app/chip/saved_registers.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <string>

#include "base/error.hpp"
#include "base/rng.hpp"
#include "base/temporary_folder.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class SavedRegisters : public ::testing::Test {
 protected:
  std::vector<host::Setting> read(const std::string& text) const {
    const auto path = folder_.path() / "head.toml";
    std::ofstream(path) << text;
    return read_saved_registers(path);
  }
  std::string refusal(const std::string& text) const {
    try {
      read(text);
    } catch (const UserError& error) {
      return error.what();
    }
    return "no refusal";
  }
  static std::vector<std::uint16_t> reset_words() {
    std::vector<std::uint16_t> words;
    for (const host::Register* reg : kept_registers())
      words.push_back(
          static_cast<std::uint16_t>(chip::spec::kHolding[reg->address - chip::spec::kHoldingBase].reset));
    return words;
  }
  static std::string changed(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  const std::string sound_ = saved_registers_text(reset_words());

 private:
  TemporaryFolder folder_;
};

TEST_F(SavedRegisters, AnyWordsComeBack) {
  const std::uint64_t seed = std::random_device{}();
  Rng rng = stream(seed, "saved registers");
  for (int i = 0; i < 200; ++i) {
    std::vector<std::uint16_t> words;
    for (const host::Register* reg : kept_registers())
      words.push_back(static_cast<std::uint16_t>(
          reg->min + static_cast<int>(rng.below(static_cast<std::uint64_t>(reg->max - reg->min) + 1))));
    const auto settings = read(saved_registers_text(words));
    ASSERT_EQ(settings.size(), words.size());
    for (std::size_t k = 0; k < words.size(); ++k)
      ASSERT_EQ(host::to_raw(*settings[k].reg, settings[k].value), words[k])
          << settings[k].reg->name << ", seed " << seed;
  }
}

TEST_F(SavedRegisters, TheEndsOfEachRangeComeBack) {
  for (const bool most : {false, true}) {
    std::vector<std::uint16_t> words;
    for (const host::Register* reg : kept_registers())
      words.push_back(static_cast<std::uint16_t>(most ? reg->max : reg->min));
    const auto settings = read(saved_registers_text(words));
    ASSERT_EQ(settings.size(), words.size());
    for (std::size_t i = 0; i < words.size(); ++i)
      EXPECT_EQ(host::to_raw(*settings[i].reg, settings[i].value), words[i]) << settings[i].reg->name;
  }
}

TEST_F(SavedRegisters, HoldNothingOfAJobOrOfTheLine) {
  for (const host::Register* reg : kept_registers())
    EXPECT_THAT((std::vector<std::string_view>{"CMD", "SETPOINT", "LOCK", "BAUD", "ADDRESS"}),
                ::testing::Not(::testing::Contains(reg->name)));
  EXPECT_GT(kept_registers().size(), 40u);
}

TEST_F(SavedRegisters, AreRefusedWithThePlaceOfWhatIsWrong) {
  EXPECT_EQ(read(sound_).size(), kept_registers().size());
  EXPECT_THAT(refusal(changed(sound_, "KP = ", "KPP = ")),
              AllOf(HasSubstr("head.toml"), HasSubstr("registers.KP"), HasSubstr("every register")));
  EXPECT_THAT(refusal(changed(sound_, "[registers]\n", "[registers]\nSETPOINT = 100\n")),
              HasSubstr("SETPOINT"));
  EXPECT_THAT(refusal(changed(sound_, "T_MAX = 150.0", "T_MAX = 1500.0")),
              AllOf(HasSubstr("T_MAX"), HasSubstr("1500"), HasSubstr("head.toml:")));
  EXPECT_THAT(refusal(changed(sound_, "T_MAX = 150.0", "T_MAX = nan")), HasSubstr("T_MAX"));
  const std::string ts = sound_.substr(sound_.find("\nTS = ") + 1);
  EXPECT_THAT(refusal(changed(sound_, ts.substr(0, ts.find('\n')), "TS = 2000.6")),
              ::testing::EndsWith("registers.TS: found 2000.6, expected 10 to 2000 ms"));
  EXPECT_THAT(refusal(changed(sound_, "BAD_MAX = 3", "BAD_MAX = 3.5")),
              AllOf(HasSubstr("BAD_MAX"), HasSubstr("head.toml:")));
  EXPECT_THAT(refusal(changed(sound_, fmt::format("0x{:04X}", chip::spec::kMapCrc), "0x0001")),
              AllOf(HasSubstr("map_crc"), HasSubstr("save them again")));
  EXPECT_THAT(refusal(changed(sound_, "map_crc", "# map_crc")), HasSubstr("map_crc"));
}

// A file that was cut anywhere is no set of registers.
TEST_F(SavedRegisters, ACutFileIsRefused) {
  const std::size_t whole = sound_.rfind(" = ") + 3;  // up to the last value
  for (std::size_t length = 0; length <= whole; length += 7)
    EXPECT_NE(refusal(sound_.substr(0, length)), "no refusal") << length;
}

}  // namespace
}  // namespace meltstage::app
