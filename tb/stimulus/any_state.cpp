// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/any_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>

#include "base/rng.hpp"
#include "cmodel/invariants.hpp"
#include "tb/lockstep/bench.hpp"
#include "tb/pins/flop_table.hpp"
#include "tb/stimulus/any_value.hpp"
#include "tb/stimulus/random_requests.hpp"
#include "tb/stimulus/random_run.hpp"

namespace meltstage::tb {

namespace {

// The flops of one bit, whose changes are the events.
const FlopWords& events() {
  static const FlopWords list = [] {
    FlopWords made;
    for (const FlopBlock& block : flop_blocks()) {
      for (const FlopWords& flops : block) {
        if (flops.size() == 1 && flops[0].width == 1) made.push_back(flops[0]);
      }
    }
    return made;
  }();
  return list;
}

// ---- A trial ---------------------------------------------------------------------------------------------

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

void set_flop(const Flop& flop, std::uint64_t value, chip::Chip& chip) {
  const std::uint64_t now = flop.get(chip, flop.word);
  flop.set(chip, flop.word, (value & flop.changeable) | (now & ~flop.changeable));
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

// The registers themselves.
bool is_mem(const FlopBlock& block) { return block[0][0].name.starts_with("mem."); }

// Whether a flop of the block is another.
bool differs(const FlopBlock& block, const chip::Chip& one, const chip::Chip& other) {
  return std::ranges::any_of(block, [&](const FlopWords& flops) {
    return std::ranges::any_of(
        flops, [&](const Flop& flop) { return flop.get(one, flop.word) != flop.get(other, flop.word); });
  });
}

}  // namespace

// ---- Moments ---------------------------------------------------------------------------------------------

// The model alone, whose moments are kept.
class Collector final : public Device {
 public:
  Collector(const chip::Chip& start, Rng& rng, Moments& moments, std::vector<std::uint64_t>& met)
      : model_(start), rng_(rng), moments_(moments), met_(met) {}

  chip::Outputs step(const chip::Inputs& in) override {
    const chip::Chip before = model_;
    const chip::Outputs out = model_.step(in);
    if (in.rst_n) {
      const FlopWords& flops = events();
      for (std::size_t i = 0; i < flops.size(); ++i) {
        const std::uint64_t was = flops[i].get(before, 0);
        if (was != flops[i].get(model_, 0)) keep(2 * i + was, {before, in, {}});
      }
    }
    return out;
  }
  const chip::Chip& model() const override { return model_; }
  void restart(const chip::Chip& state, const chip::Inputs&) override { model_ = state; }
  Compared finish() override { return {}; }

 private:
  static constexpr std::size_t kKept = 16;  // moments of an event

  // Each moment of an event is as likely to be kept (reservoir sampling).
  void keep(std::size_t event, const Moment& moment) {
    std::vector<Moment>& kept = moments_.of_events_[event];
    const std::uint64_t place = kept.size() < kKept ? kept.size() : rng_.below(met_[event] + 1);
    ++met_[event];
    if (place == kept.size() && kept.size() < kKept)
      kept.push_back(moment);
    else if (place < kept.size())
      kept[place] = moment;
  }

  chip::Chip model_;
  Rng& rng_;
  Moments& moments_;
  std::vector<std::uint64_t>& met_;
};

Moments::Moments(std::uint64_t first, std::uint64_t seeds, std::uint64_t clocks)
    : of_events_(2 * events().size()) {
  std::vector<std::uint64_t> met(of_events_.size());
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    Rng rng = stream(seed, "moments");
    random_run(std::make_unique<Collector>(random_start(seed), rng, *this, met), seed, clocks);
  }
  std::erase_if(of_events_, [](const auto& kept) { return kept.empty(); });
  find_registers_read();
}

// A block reads a register when another value of it makes another next state of the block.
void Moments::find_registers_read() {
  std::vector<std::set<unsigned>> by_block(flop_blocks().size());
  Rng rng(0, "registers read");
  for (std::vector<Moment>& kept : of_events_) {
    for (Moment& moment : kept) {
      chip::Chip stepped = moment.chip;
      stepped.step(moment.in);
      for (unsigned index = 1; index < spec::kHoldingCount; ++index) {
        chip::Chip other = moment.chip;
        other.mem.preset(index, any_register_value(rng, index));
        other.step(moment.in);
        bool read = false;
        for (std::size_t block = 0; block < by_block.size(); ++block) {
          if (is_mem(flop_blocks()[block]) || !differs(flop_blocks()[block], stepped, other)) continue;
          by_block[block].insert(index);
          read = true;
        }
        if (read) moment.registers_read.push_back(index);
      }
    }
  }
  for (const std::set<unsigned>& registers : by_block)
    read_by_.emplace_back(registers.begin(), registers.end());
}

bool holds_invariants(const chip::Chip& chip) {
  const chip::Invariants hold = chip::invariants_of(chip);
  return hold.reset_ends_in_order != 0 && hold.telemetry_reads_alone != 0 &&
         hold.frame_count_is_bounded != 0 && hold.product_steps_are_bounded != 0;
}

namespace {

Neighbours any_block(Rng& rng, const Moments& moments, const Moment& moment) {
  const std::uint64_t block = rng.below(flop_blocks().size());
  return {flop_blocks()[block], one_in(rng, 2) ? moment.registers_read : moments.registers_read_by(block)};
}

void change_one_flop(Rng& rng, const Moments& moments, Moment& moment) {
  const Neighbours block = any_block(rng, moments, moment);
  change_flop(rng, block.flops[rng.below(block.flops.size())], block, moment.chip);
  moment.chip.mem.refresh_params();
}

}  // namespace

void change_one_block(Rng& rng, const Moments& moments, Moment& moment) {
  change_flops(rng, any_block(rng, moments, moment), moment.chip);
}

Moment any_moment(Rng& rng, const Moments& moments) {
  const auto& kept = moments.of_events()[rng.below(moments.of_events().size())];
  Moment moment = kept[rng.below(kept.size())];
  switch (rng.below(3)) {
    case 0:  // what one bit keeps from happening
      flip_one_bit(rng, moment.chip);
      return moment;
    case 1:
      change_registers(rng, moment.chip);
      change_one_flop(rng, moments, moment);
      return moment;
    default:
      change_registers(rng, moment.chip);
      for (unsigned changed = one_of(rng, std::array{0u, 1u, 1u, 1u, 2u, 2u, 3u, 14u}); changed > 0;
           --changed)
        change_one_block(rng, moments, moment);
      return moment;
  }
}

TrialCount step_from_any_state(const Moments& moments, VerilatedRtl& rtl, std::uint64_t seed,
                               std::uint64_t first, std::uint64_t count) {
  TrialCount reached;
  rtl.set_assertions(false);  // they speak of states that a sound chip has
  for (std::uint64_t trial = first; trial < first + count; ++trial) {
    Rng rng = stream(seed + (trial << 20), "any state");
    const Moment moment = any_moment(rng, moments);
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
      ++reached.clocks;
      stir_pins(rng, rarity, in);
    }
    ++reached.compared;
  }
  return reached;
}

}  // namespace meltstage::tb
