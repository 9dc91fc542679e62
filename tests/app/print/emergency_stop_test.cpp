// SPDX-License-Identifier: Apache-2.0
// The emergency stop in the middle of a print: the same wire is the chip's inhibit pin and the stage's stop.
// Heater off at once, stage at rest within its limits, and no step lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/print/job_plan.hpp"
#include "motion/stage/stage.hpp"
#include "recording/stream.hpp"
#include "tb/printer/printer.hpp"

namespace meltstage {
namespace {

struct Recorded {
  tb::PrintJob job;
  recording::Stream stream;
  tb::PrintResult result;
};

Recorded record(const std::vector<tb::PrintEvent>& events) {
  Recorded run;
  run.job = app::load_job(MELTSTAGE_SOURCE_DIR "/examples/first.toml").job;
  run.job.rtl = tb::RtlWindows::none;
  run.job.events = events;
  run.result = tb::run_print(run.job, run.stream, [](const tb::PrintProgress&) {});
  return run;
}

/// Cycles at which a pin rose, by the pin's name.
std::map<std::string, std::vector<std::uint64_t>> rises(const recording::Stream& stream) {
  std::map<std::string, std::vector<std::uint64_t>> found;
  recording::ChangeReader reader(stream);
  for (recording::Change change; reader.next(change);)
    if (change.value == 1) found[stream.header().pins[change.pin].name].push_back(change.cycle);
  return found;
}

/// Position of an axis by its step and direction pins, from the start of the recording.
std::int64_t counted_pulses(const recording::Stream& stream, const std::string& axis, std::int64_t from) {
  const std::uint32_t step = recording::find_pin(stream.header(), axis + "_step").value();
  const std::uint32_t dir = recording::find_pin(stream.header(), axis + "_dir").value();
  recording::ChangeReader reader(stream);
  bool up = false;
  for (recording::Change change; reader.next(change);) {
    if (change.pin == dir) up = change.value == 1;
    if (change.pin == step && change.value == 1) from += up ? 1 : -1;
  }
  return from;
}

TEST(EmergencyStop, SwitchesTheHeaterOffAndKeepsTheStagesPosition) {
  const Recorded whole = record({});
  ASSERT_TRUE(whole.result.good) << whole.result.verdict;
  const double clock_hz = whole.job.stage.clock_hz;
  auto undisturbed = rises(whole.stream);
  // Among the steps of the print, while the head is heated: the stage moves.
  const auto& steps = undisturbed["x_step"];
  ASSERT_GT(steps.size(), 1000U);
  const double stop_s = static_cast<double>(steps[steps.size() / 5]) / clock_hz;
  const auto after_stop = [&](const std::vector<std::uint64_t>& cycles) {
    return std::count_if(cycles.begin(), cycles.end(),
                         [&](std::uint64_t c) { return static_cast<double>(c) > stop_s * clock_hz; });
  };
  EXPECT_GT(after_stop(undisturbed["heater_o"]), 10);  // or the test below would show nothing

  const Recorded stopped = record({{stop_s, tb::EventKind::emergency_stop}});
  EXPECT_FALSE(stopped.result.good);
  auto pins = rises(stopped.stream);
  ASSERT_EQ(pins["inhibit_i"].size(), 1U);
  const std::uint64_t pressed = pins["inhibit_i"].front();
  const auto last_heat = pins["heater_o"].back();
  EXPECT_LE(last_heat, pressed);

  // The stage: steps for a while yet, no longer than the limits need from the job's speed, then none.
  std::uint64_t last_step = 0;
  for (const char* axis : {"x_step", "y_step"})
    if (!pins[axis].empty()) last_step = std::max(last_step, pins[axis].back());
  const auto& limits = stopped.job.stage.axes[0].limits;
  const double longest_s = limits.velocity_mm_s / limits.deceleration_mm_s2 +
                           2.0 * limits.deceleration_mm_s2 / limits.jerk5_mm_s3 + 0.01;
  EXPECT_GT(last_step, pressed);
  EXPECT_LT(static_cast<double>(last_step - pressed) / clock_hz, longest_s);

  // Where it stands by its pins is on the line between two bumps of the print, to a pulse.
  const auto& axes = stopped.job.stage.axes;
  Eigen::Vector2d stands;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto start = motion::mm_to_pulses(axes[i], stopped.job.start_mm[static_cast<Eigen::Index>(i)]);
    stands[static_cast<Eigen::Index>(i)] =
        motion::pulses_to_mm(axes[i], counted_pulses(stopped.stream, i == 0 ? "x" : "y", start));
  }
  double nearest_mm = 1e9;
  Eigen::Vector2d from = stopped.job.start_mm.head<2>();
  for (const motion::Point& bump : stopped.job.bumps) {
    const Eigen::Vector2d to(bump.x_mm, bump.y_mm);
    const double length2 = (to - from).squaredNorm();
    const double share = length2 > 0.0 ? std::clamp((stands - from).dot(to - from) / length2, 0.0, 1.0) : 0.0;
    nearest_mm = std::min(nearest_mm, (from + share * (to - from) - stands).norm());
    from = to;
  }
  EXPECT_LE(nearest_mm, motion::pulse_length_mm(axes[0]));
}

}  // namespace
}  // namespace meltstage
