// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/any_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>

#include "base/rng.hpp"
#include "cmodel/invariants.hpp"
#include "tb/lockstep/bench.hpp"
#include "tb/pins/flop_table.hpp"
#include "tb/stimulus/any_value.hpp"
#include "tb/stimulus/decision_edge.hpp"
#include "tb/stimulus/random_requests.hpp"
#include "tb/stimulus/random_run.hpp"
#include "tb/stimulus/still_bits.hpp"

namespace meltstage::tb {

namespace {

// A chance of 1 in so many; 0: never.
bool happens(Rng& rng, unsigned rarity) { return rarity != 0 && one_in(rng, rarity); }

template <std::size_t n>
unsigned one_of(Rng& rng, const std::array<unsigned, n>& list) {
  return list[rng.below(n)];
}

void change_registers(Rng& rng, chip::Chip& chip) {
  const unsigned rarity = one_of(rng, std::array{0u, 32u, 4u, 1u});
  for (unsigned index = 1; index < spec::kHoldingCount; ++index) {
    if (happens(rng, rarity)) chip.mem.preset(index, any_register_value(rng, index));
  }
}

void change_flop(Rng& rng, const FlopWords& words, const Neighbours& block, chip::Chip& chip) {
  const Flop& flop = words[rng.below(words.size())];
  set_flop(flop, any_value_of(rng, flop, block, chip), chip);
}

void change_flops(Rng& rng, const Neighbours& block, chip::Chip& chip) {
  const unsigned rarity = one_of(rng, std::array{16u, 4u, 1u});
  for (const FlopWords& words : block.flops)
    if (one_in(rng, rarity)) change_flop(rng, words, block, chip);
  chip.mem.refresh_params();
}

// Any bit of any flop, the lowest and the highest of it more often: a comparison may leave them out.
void flip_one_bit(Rng& rng, chip::Chip& chip) {
  const FlopBlock& block = flop_blocks()[rng.below(flop_blocks().size())];
  const FlopWords& words = block[rng.below(block.size())];
  const Flop& flop = words[rng.below(words.size())];
  const std::array<std::uint64_t, 4> bits{0, flop.width - 1, rng.below(flop.width), rng.below(flop.width)};
  set_flop(flop, flop.get(chip, flop.word) ^ std::uint64_t{1} << bits[rng.below(bits.size())], chip);
  chip.mem.refresh_params();
}

// Each pin changes now and then; reset and test mode more rarely.
void stir_pins(Rng& rng, unsigned rarity, chip::Inputs& in) {
  if (happens(rng, rarity)) in.uart_rx = !in.uart_rx;
  if (happens(rng, rarity)) in.spi_miso = !in.spi_miso;
  if (happens(rng, rarity)) in.heater_fb = !in.heater_fb;
  if (happens(rng, rarity)) in.drop = !in.drop;
  if (happens(rng, 8 * rarity)) in.inhibit = !in.inhibit;
  if (happens(rng, 8 * rarity)) in.test_mode = !in.test_mode;
  if (happens(rng, 8 * rarity)) in.addr_strap = static_cast<std::uint8_t>(rng.below(8));
  in.rst_n = !happens(rng, 32 * rarity);
}

}  // namespace

bool holds_invariants(const chip::Chip& chip) {
  const chip::Invariants hold = chip::invariants_of(chip);
  return hold.reset_ends_in_order != 0 && hold.telemetry_reads_alone != 0 &&
         hold.frame_count_is_bounded != 0 && hold.product_steps_are_bounded != 0;
}

namespace {

Neighbours neighbours_in(Rng& rng, std::size_t block, const Moments& moments, const Moment& moment) {
  return {flop_blocks()[block], one_in(rng, 2) ? moment.registers_read : moments.registers_read_by(block),
          moments.any(rng).chip};
}

Neighbours any_block(Rng& rng, const Moments& moments, const Moment& moment) {
  return neighbours_in(rng, rng.below(flop_blocks().size()), moments, moment);
}

void change_one_flop(Rng& rng, const Neighbours& block, Moment& moment) {
  change_flop(rng, block.flops[rng.below(block.flops.size())], block, moment.chip);
  moment.chip.mem.refresh_params();
}

// Flops on which the next clock of a block depends, one after the other: often at a value beside which it
// would go another way.
void steer_a_block(Rng& rng, const Moments& moments, Moment& moment) {
  const std::size_t block = one_in(rng, 4) ? rng.below(flop_blocks().size()) : moment.block;
  const std::vector<const Flop*>& steering = moment.steering[block];
  if (steering.empty()) return;
  const Neighbours beside = neighbours_in(rng, block, moments, moment);
  for (std::uint64_t changes = 1 + rng.below(3); changes > 0; --changes) {
    const Flop& flop = *steering[rng.below(steering.size())];
    const auto draw = [&] { return any_value_of(rng, flop, beside, moment.chip) & ones(flop.width); };
    if (one_in(rng, 3)) {
      set_flop(flop, draw(), moment.chip);
      continue;
    }
    // from the ends of its range as often as not
    const std::array<std::uint64_t, 3> ends{0, ones(flop.width), draw()};
    constexpr unsigned kPairs = 4;
    for (unsigned pair = 0; pair < kPairs; ++pair) {
      const std::uint64_t low = ends[rng.below(ends.size())], high = draw();
      if (set_at_decision_edge(rng, flop_blocks()[block], flop, low, high, moment.in, moment.chip)) break;
    }
  }
}

void change_registers_read(Rng& rng, Moment& moment) {
  const unsigned rarity = one_of(rng, std::array{0u, 2u, 1u});
  for (const unsigned index : moment.registers_read)
    if (happens(rng, rarity)) moment.chip.mem.preset(index, any_register_value(rng, index));
}

}  // namespace

void change_one_block(Rng& rng, const Moments& moments, Moment& moment) {
  change_flops(rng, any_block(rng, moments, moment), moment.chip);
}

Moment any_moment(Rng& rng, const Moments& moments) {
  Moment moment = moments.any(rng);
  switch (rng.below(4)) {
    case 0:  // what one bit keeps from happening
      flip_one_bit(rng, moment.chip);
      return moment;
    case 1:
      change_registers(rng, moment.chip);
      change_one_flop(rng, any_block(rng, moments, moment), moment);
      return moment;
    case 2:
      change_registers(rng, moment.chip);
      for (unsigned changed = one_of(rng, std::array{0u, 1u, 1u, 1u, 2u, 2u, 3u, 14u}); changed > 0;
           --changed)
        change_one_block(rng, moments, moment);
      return moment;
    default:
      change_registers_read(rng, moment);
      steer_a_block(rng, moments, moment);
      return moment;
  }
}

namespace {

constexpr unsigned kCounting = 8;  // one trial in so many begins where a flop is about to change

void change_a_flop_that_it_may_need(Rng& rng, const Moments& moments, Moment& moment) {
  const std::size_t block = one_in(rng, 2) ? moment.block : rng.below(flop_blocks().size());
  change_one_flop(rng, neighbours_in(rng, block, moments, moment), moment);
}

// Before any bit of any flop may switch. One that has not switched yet is tried with the model till it does.
Moment before_a_switch(Rng& rng, const Moments& moments, const StillBits& bits) {
  constexpr unsigned kTries = 100;
  for (unsigned tries = 0; tries < kTries; ++tries) {
    std::optional<Aim> aim = bits.aim(rng);
    if (!aim) continue;
    if (!one_in(rng, 3)) change_a_flop_that_it_may_need(rng, moments, aim->moment);
    if (!bits.is_still(*aim) || aim->switches()) return std::move(aim->moment);
  }
  return any_moment(rng, moments);
}

}  // namespace

TrialCount step_from_any_state(const Moments& moments, VerilatedRtl& rtl, std::uint64_t seed,
                               std::uint64_t first, std::uint64_t count) {
  TrialCount reached;
  StillBits bits;
  rtl.set_assertions(false);  // they speak of states that a sound chip has
  for (std::uint64_t trial = first; trial < first + count; ++trial) {
    Rng rng = stream(seed + (trial << 20), "any state");
    const Moment moment =
        one_in(rng, kCounting) ? before_a_switch(rng, moments, bits) : any_moment(rng, moments);
    chip::Chip chip = moment.chip;
    if (!holds_invariants(chip)) {
      ++reached.refused;
      continue;
    }
    chip::Inputs in = moment.in;
    FailedStretch stretch{chip, {}};
    rtl.load(chip, in);
    const unsigned rarity = one_of(rng, std::array{0u, 32u, 2u});
    const unsigned clocks = one_in(rng, 32) ? 64 : one_of(rng, std::array{1u, 1u, 1u, 1u, 2u, 2u, 4u, 8u});
    for (unsigned clock = 1; clock <= clocks; ++clock) {
      stretch.inputs.push_back(in);
      const chip::Chip before = chip;
      const chip::Outputs expected = chip.step(in);
      const chip::Outputs got = rtl.step(in);
      if (got != expected || !rtl.flops_equal(chip)) {
        std::string report = fmt::format(
            "MISMATCH from any state: meltstage regress one any_state.{} --amount {}, the last trial, clock "
            "{}\n",
            seed, trial + 1, clock);
        for (const FlopDifference& flop : rtl.differences(chip))
          report += fmt::format("{}: RTL {:#x}, model {:#x}\n", flop.name, flop.dut, flop.model);
        if (got != expected) report += "output pins differ\n";
        throw Mismatch(report + "the state before differed from reset in\n" +
                           list_differences(chip::Chip{}, moment.chip),
                       std::make_shared<const FailedStretch>(std::move(stretch)));
      }
      bits.observe(before, in, chip);
      if (in.rst_n) reached.crosses.observe(before, chip);
      ++reached.clocks;
      stir_pins(rng, rarity, in);
    }
    ++reached.compared;
  }
  reached.toggles = bits.toggles();
  return reached;
}

}  // namespace meltstage::tb
