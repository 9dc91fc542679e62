// SPDX-License-Identifier: Apache-2.0
// Runs the chip from event to event. Use and contract: docs/chip/cmodel.md.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>

#include "chip.hpp"

namespace meltstage::chip {

// What is around the chip's pins.
template <class T>
concept Surroundings = requires(T around, std::uint64_t cycle, const Outputs& out) {
  // Input pins at the clock edge that ends `cycle`, from the output pins standing in it.
  { around.step(cycle, out) } -> std::same_as<Inputs>;
  // First cycle in which the input pins may change although the output pins do not.
  { around.next_event() } -> std::convertible_to<std::uint64_t>;
};

// Input pins that stand, whatever the chip does.
struct StillPins {
  Inputs in;
  Inputs step(std::uint64_t, const Outputs&) const { return in; }
  std::uint64_t next_event() const { return kForever; }
};

// The chip somewhere in its run.
struct Run {
  Chip chip;
  Outputs out = chip.outputs({.rst_n = false});
  std::uint64_t cycle = 0;
};

// Steps the chip clock by clock; the reference that advance() equals.
template <Surroundings Around, std::invocable<std::uint64_t, const Inputs&, const Outputs&> Observer>
void step_until(Run& run, std::uint64_t until, Around& around, Observer&& observe) {
  for (; run.cycle < until; ++run.cycle) {
    const Inputs in = around.step(run.cycle, run.out);
    observe(run.cycle, in, run.out);
    run.out = run.chip.step(in);
  }
}

// The same pins, and the same state at `until`, but clocks in which the chip only counts are skipped.
// `around` is stepped, and `observe` called, in every cycle whose pins differ from those of the cycle before,
// and in some more; the chip's counters stand still meanwhile.
template <Surroundings Around, std::invocable<std::uint64_t, const Inputs&, const Outputs&> Observer>
void advance(Run& run, std::uint64_t until, Around& around, Observer&& observe) {
  const auto look = [&] {
    const Inputs in = around.step(run.cycle, run.out);
    observe(run.cycle, in, run.out);
    return in;
  };
  if (run.cycle >= until) return;
  Inputs in = look();
  bool due = false;  // a stretch has just ended by itself: something moves in the next clock
  for (;;) {
    const std::uint64_t quiet = due ? 0 : run.chip.quiet(in);
    if (quiet == 0) {
      due = false;
      run.out = run.chip.step(in);
      if (++run.cycle == until) return;
      in = look();
      continue;
    }
    const std::uint64_t begin = run.cycle;
    const std::uint64_t end = begin + std::min(quiet, until - begin);
    const Inputs standing = in;
    Outputs out = run.chip.outputs(in);
    // inhibit_i acts on heater_o without a clock.
    std::uint64_t stop = out == run.out ? end : begin + 1;
    // Otherwise safe_en_o alone moves, in a known rhythm.
    const std::uint64_t to_edge = run.chip.guard.clocks_to_safe_edge();
    std::uint64_t safe_edge = to_edge == kForever ? kForever : begin + to_edge;
    do {
      stop = std::min({stop, std::max(around.next_event(), run.cycle + 1), safe_edge});
      if (stop == safe_edge) {
        out.safe_en = !out.safe_en;
        safe_edge += kSafeEnClocks;
      }
      run.out = out;
      run.cycle = stop;
      if (stop == until) break;
      in = look();
      stop = end;
    } while (in == standing && run.cycle < end);
    run.chip.skip(standing, run.cycle - begin);
    due = run.cycle - begin == quiet;
    if (run.cycle == until) return;
  }
}

}  // namespace meltstage::chip
