// SPDX-License-Identifier: Apache-2.0
// What the tests of `meltstage hls` share: a block in a folder of its own, and the commands on it.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/support/run_command.hpp"

namespace meltstage {
namespace fs = std::filesystem;

inline const std::string kExample = MELTSTAGE_SOURCE_DIR "/examples/hls/debounce";

inline std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

inline std::string replaced(std::string text, const std::string& what, const std::string& by) {
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

  Ran compare(const std::string& options) const {
    return run_command("hls compare " + at("block.cpp") + " --option=-I" MELTSTAGE_SOURCE_DIR " " + options);
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
  void expect_broken_promise(const std::string& body, const std::string& message) const {
    write_block(body);
    ASSERT_EQ(translate().status, 0) << body << translate().output;
    const Ran ran = prove("--block promises");
    EXPECT_EQ(ran.status, 1) << body << "\n" << ran.output;
    EXPECT_THAT(ran.output, ::testing::HasSubstr(message)) << body;
  }
  void expect_refused(const std::string& body, const std::string& message) const {
    write_block(body);
    expect_refusal(message);
  }
  void expect_refusal(const std::string& message) const {
    const Ran ran = translate();
    const std::string block = text_of(at("block.cpp"));
    EXPECT_EQ(ran.status, 2) << block << "\n" << ran.output;
    EXPECT_THAT(ran.output, ::testing::HasSubstr(message)) << block;
    EXPECT_EQ(std::count(ran.output.begin(), ran.output.end(), '\n'), 1) << ran.output;
    EXPECT_FALSE(fs::exists(at("block.sv"))) << block;
  }

  fs::path folder_;
};

}  // namespace meltstage
