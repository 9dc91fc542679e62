// SPDX-License-Identifier: Apache-2.0
// Verilog that a person gives may hang, end or say what it likes: the run in Icarus ends, and tells what it
// saw.
#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "asic/dft/scan/replay.hpp"
#include "asic/dft/scan/simulator.hpp"
#include "base/error.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr IcarusLimits kShort{20s, 2s};

// Whether a process works in the folder; a killed one may take a moment to go.
bool is_worked_in(const fs::path& folder) {
  std::error_code ignored;
  bool found = true;
  for (int i = 0; found && i < 100; ++i) {
    if (i != 0) std::this_thread::sleep_for(50ms);
    found = false;
    for (const fs::directory_entry& process : fs::directory_iterator("/proc"))
      found = found || fs::read_symlink(process.path() / "cwd", ignored) == folder;
  }
  return found;
}

class Readback : public testing::Test {
 protected:
  ReplayResult run(const std::string& more, const IcarusLimits& limits = kShort) {
    const fs::path file = folder_.file("readback.v",
                                       "module bitstream (input clk_i, input d, output reg q_o);\n"
                                       "initial q_o = 0;\nalways @(posedge clk_i) q_o <= d;\n" +
                                           more + "\nendmodule\n");
    CycleStream stream;
    stream.title = "pins";
    stream.signals = {{"clk_i", true}, {"d", true}, {"q_o", false}};
    stream.cycles = {{"P0X", ""}, {"P1L", ""}, {"P1H", "", 300}, {"P0H", ""}};
    work_ = folder_.path() / "work";
    fs::create_directory(work_);
    return replay_verilog_in_icarus(file, stream, work_, {}, limits);
  }
  void expect_refused(const std::string& more, const std::string& said) {
    EXPECT_THAT([&] { run(more); },
                ThrowsMessage<UserError>(testing::AllOf(
                    testing::StartsWith((folder_.path() / "readback.v: Icarus ").string()), HasSubstr(said))))
        << more;
    EXPECT_FALSE(is_worked_in(work_)) << more;
  }
  TestFolder folder_;
  fs::path work_;
};

TEST_F(Readback, GoodVerilogRuns) {
  const ReplayResult result = run("");
  EXPECT_EQ(result.cycles, 303U);
  EXPECT_EQ(result.strobes, 302U);
  EXPECT_EQ(result.mismatches, 0U);
}

TEST_F(Readback, VerilogThatNeverEndsIsStopped) {
  expect_refused(
      "initial while (1);",
      "was stopped: nothing went on for 2 s behind cycle 0 of 303, expected Verilog in which time goes on");
  expect_refused("initial begin #15000; while (1) $display(\"busy\"); end", "behind cycle 149 of 303");
  expect_refused("initial forever $display(\"done 7\");", "behind cycle 7 of 303");
}

TEST_F(Readback, AnEndBeforeTheVectorsIsTold) {
  expect_refused(
      "initial $finish;",
      "ended behind cycle 0 of 303 (exit status 0) without a word, expected Verilog that runs to the end");
  expect_refused("initial begin $display(\"I had\\nenough\"); $finish; end",
                 "(exit status 0): I had, expected");
  expect_refused("initial begin $display(\"5 cycles, 5 strobes, 0 mismatches\"); $finish; end",
                 "ended behind cycle 0 of 303");
  expect_refused("nonsense nonsense nonsense", "can't compile it (exit status ");
}

TEST(RunProgram, WhatTheProgramStartedEndsWithIt) {
  const TestFolder folder;
  const auto run = [&](const std::string& script, std::chrono::milliseconds most) {
    return run_program({"sh", "-c", script}, folder.path(), most, [](const std::string&) { return false; });
  };
  EXPECT_TRUE(run("sleep 60 & sleep 60", 300ms).stopped);
  EXPECT_FALSE(is_worked_in(folder.path()));
  const ProgramEnd end = run("sleep 60 > /dev/null 2>&1 & echo one; echo two >&2; exit 3", 20s);
  EXPECT_FALSE(end.stopped);
  EXPECT_EQ(end.status, 3);
  EXPECT_EQ(end.output, "one\ntwo\n");
  EXPECT_EQ(run("kill -SEGV $$", 20s).status, 128 + SIGSEGV);
  EXPECT_THAT(
      [&] { run_program({"no-such-program"}, folder.path(), 20s, [](const std::string&) { return false; }); },
      ThrowsMessage<UserError>(HasSubstr("no-such-program: found no such program")));
}

}  // namespace
}  // namespace meltstage::dft
