// SPDX-License-Identifier: Apache-2.0
// `meltstage hls`: a block of somebody else goes through it, is proved or refuted, and what can't be a
// circuit is refused by file and line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kExample = MELTSTAGE_SOURCE_DIR "/examples/hls/debounce";

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

class Hls : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("meltstage_hls_" + std::string(info->name()) + "." + std::to_string(getpid()));
    fs::create_directories(folder_);
    write("list.f", "block.sv\n");
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const { std::ofstream(at(name)) << text; }

  Ran translate(const std::string& options = "--module debounce") const {
    return run_command("hls translate " + at("block.cpp") + " --option=-I" MELTSTAGE_SOURCE_DIR " --out " +
                       at("block.sv") + " " + options);
  }
  Ran prove(const std::string& options = "") const {
    return run_command("hls prove " + at("block.cpp") + " --option=-I" MELTSTAGE_SOURCE_DIR " --rtl " +
                       at("list.f") + " --top debounce " + options);
  }

  // A block of three flops whose step is `body`, with state s, pins in and old as it was.
  void write_block(const std::string& body) const {
    write("block.cpp", R"(#include <cstdint>
#include "hls/interface.hpp"
struct State { std::uint8_t a_q, b_q[4]; std::int16_t c_q; };
struct Inputs { std::uint8_t rst_ni, x_i; };
struct Outputs { std::uint8_t y_o; };
extern "C" int elsewhere(int);
extern "C" {
void hls_reset(State* s) { *s = {}; }
void hls_step(State* s, const Inputs* in) {
  if (in->rst_ni == 0) return hls_reset(s);
)" + body + R"(
}
void hls_outputs(const State* s, const Inputs*, Outputs* out) { out->y_o = s->a_q; }
extern const meltstage::hls::Field hls_flops[] = {
    HLS_FIELD(State, a_q, 8), HLS_FIELD(State, c_q, 10),
    meltstage::hls::field<std::uint8_t>("b_q[0]", offsetof(State, b_q), 8),
    meltstage::hls::field<std::uint8_t>("b_q[1]", offsetof(State, b_q) + 1, 8),
    meltstage::hls::field<std::uint8_t>("b_q[2]", offsetof(State, b_q) + 2, 8),
    meltstage::hls::field<std::uint8_t>("b_q[3]", offsetof(State, b_q) + 3, 8)};
extern const meltstage::hls::Field hls_input_pins[] = {HLS_FIELD(Inputs, rst_ni, 1), HLS_FIELD(Inputs, x_i, 8)};
extern const meltstage::hls::Field hls_output_pins[] = {HLS_FIELD(Outputs, y_o, 8)};
}
)");
  }
  void expect_refused(const std::string& body, const std::string& message) const {
    write_block(body);
    const Ran ran = translate();
    EXPECT_EQ(ran.status, 2) << body << "\n" << ran.output;
    EXPECT_THAT(ran.output, HasSubstr(message)) << body;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_FALSE(fs::exists(at("block.sv"))) << body;
  }

  fs::path folder_;
};

TEST_F(Hls, AForeignBlockIsTranslatedAndProvedEqualToItsRtl) {
  fs::copy(kExample + ".cpp", at("block.cpp"));
  fs::copy(kExample + ".sv", at("block.sv"));
  const Ran by_hand = prove();
  EXPECT_EQ(by_hand.status, 0) << by_hand.output;
  EXPECT_THAT(by_hand.output, HasSubstr("\nproved: 9 of 9 bits equal"));
  // what it is translated to is the same circuit again
  ASSERT_EQ(translate().status, 0);
  EXPECT_THAT(text_of(at("block.sv")), HasSubstr("logic [3:0] steady_q;"));
  const Ran generated = prove();
  EXPECT_EQ(generated.status, 0) << generated.output;
  EXPECT_EQ(run_shell("verilator --lint-only -Wall -Wno-DECLFILENAME -Wno-UNUSED " + at("block.sv")).output,
            "");
}

TEST_F(Hls, AChangeOfEitherSideIsRefutedByAStateAndPins) {
  const std::string cpp = text_of(kExample + ".cpp"), sv = text_of(kExample + ".sv");
  const std::pair<std::string, std::string> in_rtl[] = {{"steady > hold_i", "steady >= hold_i"},
                                                        {"4'd15 ? 4'd15", "4'd14 ? 4'd15"},
                                                        {"pressed_q <= 1'b0", "pressed_q <= 1'b1"},
                                                        {"pressed_o = pressed_q", "pressed_o = ~pressed_q"},
                                                        {"level_q  <= button_i", "level_q <= level_q"}};
  write("block.cpp", cpp);
  for (const auto& [right, wrong] : in_rtl) {
    write("block.sv", replaced(sv, right, wrong));
    const Ran ran = prove();
    EXPECT_EQ(ran.status, 1) << wrong << "\n" << ran.output;
    EXPECT_THAT(ran.output, HasSubstr("counterexample: "));
    EXPECT_THAT(ran.output, HasSubstr("after the clock: RTL 0x"));
    EXPECT_THAT(ran.output, HasSubstr("\nrefuted: "));
  }
  write("block.sv", sv);
  for (const auto& [right, wrong] :
       {std::pair("steady_q < 15", "steady_q < 14"), std::pair("> in->hold_i", ">= in->hold_i")}) {
    write("block.cpp", replaced(cpp, right, wrong));
    EXPECT_EQ(prove().status, 1) << wrong;
  }
}

TEST_F(Hls, WhatOneSideHasAloneIsNamed) {
  const std::string cpp = text_of(kExample + ".cpp"), sv = text_of(kExample + ".sv");
  write("block.cpp", cpp);
  write("block.sv",
        replaced(replaced(sv, "logic       level_q, ", "logic       level_q, spare_q, "),
                 "level_q  <= button_i;", "level_q  <= button_i; spare_q <= hold_i[0] && spare_q; "));
  EXPECT_THAT(prove().output, HasSubstr("RTL: found flop spare_q, which the C++ has not"));
  write("block.sv", replaced(sv, "steady_q, steady", "other_q, steady") + "");
  EXPECT_EQ(prove().status, 2);
  write("block.sv", replaced(sv, "pressed_o\n", "other_o\n"));
  EXPECT_EQ(prove().status, 2);
  write("block.sv", replaced(sv, "posedge clk_i", "negedge clk_i"));
  EXPECT_EQ(prove().status, 2);
  write("block.sv", "module debounce; this is no Verilog");
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 2);
  EXPECT_THAT(ran.output, HasSubstr("RTL: Yosys refuses it: "));
}

TEST_F(Hls, LoopsArraysSwitchesAndProductsBecomeCircuits) {
  write_block(R"(  int sum = 0;
  for (int i = 0; i < 4; ++i) sum += s->b_q[i] * (i + 1);
  s->b_q[in->x_i & 3] = static_cast<std::uint8_t>(s->a_q / 7);
  switch (in->x_i >> 6) {
    case 0: s->c_q = static_cast<std::int16_t>((sum & 0x3FF) - 512); break;
    case 1: s->c_q = static_cast<std::int16_t>(s->c_q >> 1); break;
    case 2: s->a_q = static_cast<std::uint8_t>(s->a_q * in->x_i); break;
    default: s->a_q = s->b_q[s->a_q & 3];
  })");
  ASSERT_EQ(translate().status, 0) << translate().output;
  write("list.f", "block.sv\n");
  const Ran ran = prove();
  EXPECT_EQ(ran.status, 0) << ran.output;
}

TEST_F(Hls, WhatCppLeavesUndefinedIsFound) {
  write_block("  s->a_q = static_cast<std::uint8_t>(1 << (in->x_i & 63));");
  ASSERT_EQ(translate().status, 0);
  const Ran shift = prove("--block promises");
  EXPECT_EQ(shift.status, 1) << shift.output;
  EXPECT_THAT(shift.output, HasSubstr("block.cpp:11: undefined behaviour of C++"));
  write_block("  s->c_q = static_cast<std::int16_t>(s->c_q + 1);");
  ASSERT_EQ(translate().status, 0);
  const Ran wide = prove();
  EXPECT_EQ(wide.status, 1) << wide.output;
  EXPECT_THAT(wide.output, HasSubstr("c_q has more bits than the circuit"));
}

TEST_F(Hls, WhatCanBeNoCircuitIsRefusedByFileAndLine) {
  expect_refused("  while (s->a_q != in->x_i) ++s->a_q;",
                 "block.cpp:11: found a loop whose end is not known");
  expect_refused("  s->a_q = static_cast<std::uint8_t>(elsewhere(in->x_i));",
                 "block.cpp:11: found a call of elsewhere");
  expect_refused("  s->a_q = static_cast<std::uint8_t>(1.5 * in->x_i);", "block.cpp:11: found ");
  expect_refused("  s->a_q = static_cast<std::uint8_t>(reinterpret_cast<std::uintptr_t>(s));",
                 "block.cpp:11: found ");
  expect_refused("  s->a_q = nothing;", "block.cpp:11:");
  write("block.cpp", "int main() {}\n");
  EXPECT_THAT(translate().output, HasSubstr("block.cpp"));
  EXPECT_EQ(translate().status, 2);
}

TEST_F(Hls, FilesThatAreMissingOrReadAreNamed) {
  EXPECT_EQ(run_command("hls translate " + at("none.cpp") + " --out " + at("x.sv")).status, 2);
  fs::copy(kExample + ".cpp", at("block.cpp"));
  const Ran own = run_command("hls translate " + at("block.cpp") +
                              " --option=-I" MELTSTAGE_SOURCE_DIR " --out " + at("block.cpp"));
  EXPECT_EQ(own.status, 2);
  EXPECT_EQ(text_of(at("block.cpp")), text_of(kExample + ".cpp"));
  EXPECT_THAT(prove().output, HasSubstr("block.sv"));
  EXPECT_EQ(prove("--tie nonsense").status, 2);
}

}  // namespace
}  // namespace meltstage
