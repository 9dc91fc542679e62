// SPDX-License-Identifier: Apache-2.0
// What a mismatch tells and leaves behind: the RTL starts with one flop changed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "recording/text.hpp"
#include "tb/lockstep/bench.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tests/base/scratch_folder.hpp"

namespace meltstage::tb {
namespace {

using ::testing::HasSubstr;

TEST(MismatchReport, NamesTheFlopAndSavesWhatRepeatsIt) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("meltstage_mismatch." + std::to_string(getpid()));
  const chip::Chip start = chip_with(quick());
  chip::Chip changed = start;
  changed.guard.samples_q = 0x1234;
  auto rtl = make_verilated_rtl();
  rtl->load(changed, {});
  Lockstep run(std::move(rtl), start, 100, {"report", 0xABC, "repeat me"}, folder);
  std::string report;
  try {
    for (int i = 0; i < 10; ++i) run.step({});
  } catch (const Mismatch& mismatch) {
    report = mismatch.what();
  }
  for (const char* part :
       {"MISMATCH test=report seed=0xabc cycle=100", "u_guard.samples_q", "dut=0x1234 model=0x0",
        "state=Idle", "repeat: repeat me", "no clock of this run was equal", "report.txt"}) {
    EXPECT_THAT(report, HasSubstr(part));
  }
  EXPECT_LE(std::count(report.begin(), report.end(), '\n'), 24) << "more than a screen";
  const auto saved = folder / "report.abc";
  for (const char* name : {"report.txt", "stimulus.mvec", "waves.fst", "repeat.sh"}) {
    EXPECT_TRUE(std::filesystem::exists(saved / name)) << name;
    EXPECT_GT(std::filesystem::file_size(saved / name), 0u) << name;
  }
  EXPECT_EQ(recording::read_text(saved / "stimulus.mvec").first_cycle(), 100u);
  std::filesystem::remove_all(folder);
}

// A start of the sensor in Idle, to which no sound chip comes. An instance has gone before: the thread's
// Verilator context was its own.
TEST(MismatchReport, AnAssertionOfTheRtlThatFailsIsTold) {
  make_verilated_rtl();
  const ScratchFolder folder;
  chip::Chip start = chip_with(quick());
  start.sysctrl.tick_q = 1;
  auto rtl = make_verilated_rtl();
  rtl->load(start, {});
  Lockstep run(std::move(rtl), start, 100, {"asserted", 1, "repeat me"}, folder.at(""));
  const auto clocks = [&] {
    for (int i = 0; i < 4; ++i) run.step({});
  };
  EXPECT_THAT(clocks,
              testing::ThrowsMessage<Mismatch>(testing::AllOf(
                  HasSubstr("ASSERTION test=asserted seed=0x1 cycle=101"), HasSubstr("repeat: repeat me"))));
  EXPECT_GT(std::filesystem::file_size(folder.at("asserted.1/waves.fst")), 0u);
}

TEST(MismatchReport, EachFlopOfTheRtlIsLookedAt) {
  const chip::Chip start = chip_with(quick());
  auto rtl = make_verilated_rtl();
  rtl->load(start, {});
  EXPECT_TRUE(rtl->flops_equal(start));
  // A change in any one of a few blocks' flops is seen, memory words included.
  const std::vector<std::function<void(chip::Chip&)>> changes{
      [](chip::Chip& c) { c.uartc.tlm.crc_q ^= 1; },
      [](chip::Chip& c) { c.uartc.frame.words_q[15] ^= 0x8000; },
      [](chip::Chip& c) { c.mem.active_q[58] ^= 1u << 21; },
      [](chip::Chip& c) { c.mem.staged_q[1] ^= 1; },
      [](chip::Chip& c) { c.algor.filt_q ^= 1 << 21; },
      [](chip::Chip& c) { c.sensc.acc_q ^= std::int64_t{1} << 32; },
      [](chip::Chip& c) { c.pwmc.acc_q ^= 1; },
      [](chip::Chip& c) { c.sync.out_q ^= 64; },
      [](chip::Chip& c) { c.rst_sync.stage_q ^= 1; }};
  for (const auto& change : changes) {
    chip::Chip other = start;
    change(other);
    EXPECT_FALSE(rtl->flops_equal(other));
    EXPECT_EQ(rtl->differences(other).size(), 1u);
  }
}

TEST(Lockstep, RunThatComparedNothingIsAnError) {
  auto rtl = make_verilated_rtl();
  const Lockstep run(std::move(rtl), {"empty", 1, ""});
  EXPECT_THROW(run.finish(), std::logic_error);
}

}  // namespace
}  // namespace meltstage::tb
