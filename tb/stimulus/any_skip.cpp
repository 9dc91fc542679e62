// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/any_skip.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tb/lockstep/lockstep.hpp"

namespace meltstage::tb {
namespace {

// A moment is one before an event: on to where nothing happens; there, mostly, what stirs a block alone.
Moment quiet_moment(Rng& rng, const Moments& moments) {
  Moment moment = any_moment(rng, moments);
  // Reset comes to a chip that runs: in reset no flop is another than it is reset to.
  if (moment.chip.rst_sync.stage_q != 0) moment.in.rst_n = rng.below(64) != 0;
  for (int clock = 0; clock < 64 && moment.chip.quiet(moment.in) == 0; ++clock) moment.chip.step(moment.in);
  if (moment.in.rst_n && rng.below(4) != 0) change_one_block(rng, moments, moment);
  return moment;
}

// Why skipping `part` clocks isn't stepping them; empty when it is.
std::string difference(const Moment& moment, std::uint64_t part) {
  chip::Chip stepped = moment.chip, leapt = moment.chip;
  const chip::Outputs standing = stepped.outputs(moment.in);
  for (std::uint64_t clock = 0; clock < part; ++clock) {
    chip::Outputs out = stepped.step(moment.in);
    // heater_o stands on the pin's own gate; safe_en_o has a rhythm that advance() knows
    out.safe_en = standing.safe_en;
    if (out != standing) return fmt::format("output pins move in clock {}\n", clock);
  }
  leapt.skip(moment.in, part);
  return list_differences(stepped, leapt);
}

}  // namespace

std::uint64_t part_of(Rng& rng, std::uint64_t quiet) {
  const std::uint64_t most = std::min<std::uint64_t>(quiet, rng.below(8) == 0 ? 30'000 : 3'000);
  switch (rng.below(4)) {
    case 0:
      return most;
    case 1:
      return std::max<std::uint64_t>(1, most - 1);
    default:
      return 1 + rng.below(std::min(most, std::uint64_t{1} << rng.below(16)));
  }
}

SkipCount skip_from_any_state(const Moments& moments, std::uint64_t seed, std::uint64_t count) {
  SkipCount reached;
  for (std::uint64_t trial = 0; trial < count; ++trial) {
    Rng rng = stream(seed + (trial << 20), "any skip");
    const Moment moment = quiet_moment(rng, moments);
    const std::uint64_t quiet = moment.chip.quiet(moment.in);
    if (quiet == 0 || !holds_invariants(moment.chip)) continue;
    const std::uint64_t part = part_of(rng, quiet);
    if (const std::string found = difference(moment, part); !found.empty())
      throw Mismatch(
          fmt::format("MISMATCH of skip and step: seed {}, trial {}, {} clocks of {}\n{}the state before "
                      "differed from reset in\n{}",
                      seed, trial, part, quiet, found, list_differences(chip::Chip{}, moment.chip)));
    ++reached.skipped;
    reached.whole += part == quiet;
    reached.clocks += part;
  }
  return reached;
}

}  // namespace meltstage::tb
