// SPDX-License-Identifier: Apache-2.0
#include "tb/pins/model_replay.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"

namespace meltstage::tb {
namespace {

constexpr std::uint64_t kClocks = 30'000;

// A chip that is reset, gets an emergency stop at clock 20,000, and is recorded clock by clock. At `wrong`
// the record of safe_en_o is inverted.
recording::Stream record(std::uint64_t wrong = kClocks, std::uint64_t reset_clocks = 20,
                         std::uint64_t first = 0) {
  recording::Stream stream;
  recording::Recorder recorder(stream, chip_pin_header("model_replay_test"));
  chip::Chip chip;
  for (std::uint64_t clock = 0; clock < kClocks; ++clock) {
    const chip::Inputs in{.rst_n = clock >= reset_clocks, .inhibit = clock >= 20'000};
    chip::Outputs out = chip.outputs(in);
    if (clock >= wrong && clock < wrong + 5) out.safe_en = !out.safe_en;
    record_inputs(recorder, in);
    record_outputs(recorder, out);
    recorder.commit(first + clock);
    chip.step(in);
  }
  recorder.finish(first + kClocks - 1);
  return stream;
}

TEST(ModelReplay, AgreesWithItsOwnRecord) {
  const recording::Stream stream = record();
  ModelReplay replay(stream, "run");
  EXPECT_FALSE(replay.run(kClocks + 100));
  EXPECT_EQ(replay.cycle(), kClocks);
  EXPECT_FALSE(replay.mismatch());
}

TEST(ModelReplay, TellsTheFirstMismatchWhateverThePartsItRunsIn) {
  // just behind reset the model moves in every clock, later it stands
  for (const std::uint64_t wrong : {std::uint64_t{21}, std::uint64_t{12'345}}) {
    const recording::Stream stream = record(wrong);
    for (const std::uint64_t part : {std::uint64_t{1}, std::uint64_t{97}, wrong, kClocks}) {
      ModelReplay replay(stream, "run");
      while (replay.run(part)) {
      }
      ASSERT_TRUE(replay.mismatch()) << part;
      EXPECT_EQ(replay.mismatch()->cycle, wrong) << part;
      EXPECT_EQ(replay.mismatch()->pin, "safe_en_o");
      EXPECT_NE(replay.mismatch()->recorded, replay.mismatch()->chip);
    }
  }
}

TEST(ModelReplay, RefusesWhatDoesNotBeginInReset) {
  const recording::Stream released = record(kClocks, 0), late = record(kClocks, 20, 7);
  EXPECT_THROW(ModelReplay(released, "run"), UserError);
  EXPECT_THROW(ModelReplay(late, "run"), UserError);
}

}  // namespace
}  // namespace meltstage::tb
