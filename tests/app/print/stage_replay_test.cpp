// SPDX-License-Identifier: Apache-2.0
// A print job's vectors are replayed by the plan, the pulse generator and the servo axis.
#include "tb/printer/stage_replay.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <optional>

#include "app/print/job_plan.hpp"
#include "recording/stream.hpp"

namespace meltstage {
namespace {

struct Printed {
  tb::PrintJob job;
  recording::Stream stream;
  std::size_t droplets = 0;
};

/// The first example, recorded once for all tests.
const Printed& printed() {
  static const Printed once = [] {
    Printed print;
    print.job = app::load_job(MELTSTAGE_SOURCE_DIR "/examples/first.toml").job;
    print.job.rtl = tb::RtlWindows::none;
    print.droplets = tb::run_print(print.job, print.stream, [](const tb::PrintProgress&) {}).droplets;
    return print;
  }();
  return once;
}

/// The same recording with its changes altered; a change that comes back empty is left out.
recording::Stream altered(
    const std::function<std::optional<recording::Change>(const recording::Change&)>& alter) {
  recording::Stream stream;
  recording::Recorder recorder(stream, printed().stream.header());
  recording::ChangeReader reader(printed().stream);
  std::uint64_t cycle = 0;
  for (recording::Change change; reader.next(change);) {
    const auto kept = alter(change);
    if (!kept) continue;
    if (kept->cycle != cycle) recorder.commit(cycle);
    cycle = kept->cycle;
    recorder.set(kept->pin, kept->value);
  }
  recorder.commit(cycle);
  recorder.finish(printed().stream.final_cycle());
  return stream;
}

std::uint32_t pin(const char* name) { return recording::find_pin(printed().stream.header(), name).value(); }

TEST(StageReplay, PlanGeneratorAndServoAgreeWithTheRecording) {
  const tb::StageReplay replay = tb::replay_stage(printed().job, printed().stream);
  EXPECT_EQ(replay.moves, printed().job.bumps.size());
  EXPECT_EQ(replay.moves, printed().droplets);
  EXPECT_GT(replay.steps, 1000U);
  EXPECT_EQ(replay.generator_differences, 0U) << replay.first_difference;
  EXPECT_LE(replay.plan_pulses, 0.52);  // half a pulse, and what the plan moves on in one clock
  EXPECT_GE(replay.plan_pulses, 0.45);
  EXPECT_LE(replay.droplet_um, 0.6);  // half a pulse of the X axis and what the servo has left
}

TEST(StageReplay, SeesAStepThatCameLate) {
  const std::uint32_t step = pin("x_step");
  int edges = 0;
  const tb::StageReplay replay =
      tb::replay_stage(printed().job, altered([&](const recording::Change& change) {
                         recording::Change late = change;
                         if (change.pin == step && change.value == 1 && ++edges == 500) ++late.cycle;
                         return std::optional(late);
                       }));
  EXPECT_GT(replay.generator_differences, 0U);
  EXPECT_NE(replay.first_difference, "");
}

TEST(StageReplay, SeesAStepThatWasLost) {
  const std::uint32_t step = pin("x_step");
  int edges = 0;
  const tb::StageReplay replay =
      tb::replay_stage(printed().job, altered([&](const recording::Change& change) {
                         if (change.pin == step && ++edges > 1000 && edges <= 1010)
                           return std::optional<recording::Change>();
                         return std::optional(change);
                       }));
  EXPECT_GT(replay.generator_differences, 0U);
  EXPECT_GT(replay.plan_pulses, 3.0);
  EXPECT_GT(replay.droplet_um, 3.0);
}

}  // namespace
}  // namespace meltstage
