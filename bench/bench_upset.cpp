// SPDX-License-Identifier: Apache-2.0
// Every flop of the chip inverted once in each phase of a heated job: what follows, a row a block and
// outcome.
#include <fmt/format.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "base/rng.hpp"
#include "bench/bench.hpp"
#include "tb/trials/upset.hpp"

namespace meltstage::app {

namespace {

using tb::UpsetOutcome;

using Counts = std::array<unsigned, tb::kUpsetOutcomes.size()>;

}  // namespace

std::vector<BenchRow> bench_upset(const BenchOptions& options) {
  const std::vector<tb::FlopBit>& flops = tb::flop_bits();
  const std::size_t stride = options.quick ? 10 : 1;
  std::map<std::string_view, Counts> blocks;
  Counts all{};
  std::vector<BenchRow> found;
  for (const tb::UpsetPwm pwm : {tb::UpsetPwm::fast, tb::UpsetPwm::slow}) {
    const char* const rate = pwm == tb::UpsetPwm::fast ? "1 kHz" : "2 Hz";
    for (const tb::UpsetPhase phase : tb::kUpsetPhases) {
      const tb::UpsetStudy study(phase, pwm);
      Rng rng = stream(options.seed, upset_phase_name(phase));
      std::vector<tb::UpsetStudy::Strike> strikes;
      for (std::size_t i = options.seed % stride; i < flops.size(); i += stride)
        strikes.push_back({{i}, rng.uniform() * tb::UpsetStudy::kTick_s});
      std::vector<tb::UpsetStudy::Result> results(strikes.size());
      in_parallel(
          strikes.size(), [&](std::size_t i) { results[i] = study.strike(strikes[i]); }, options.progress,
          fmt::format("{}, {} PWM", upset_phase_name(phase), rate));
      for (std::size_t i = 0; i < strikes.size(); ++i) {
        const tb::FlopBit& flop = flops[strikes[i].flops.front()];
        ++blocks[flop.block][static_cast<std::size_t>(results[i].outcome)];
        ++all[static_cast<std::size_t>(results[i].outcome)];
        if (results[i].outcome == UpsetOutcome::outside) {
          found.push_back({fmt::format("outside: {}.{}[{}] bit {}, {}, {} PWM, excess", flop.block, flop.name,
                                       flop.word, flop.bit, upset_phase_name(phase), rate),
                           results[i].excess_s,
                           "s",
                           {},
                           {}});
        }
      }
    }
  }
  std::vector<BenchRow> rows{{options.quick ? "flop bits (every tenth is struck)" : "flop bits",
                              static_cast<double>(flops.size()),
                              "",
                              4000.0,
                              {}}};
  for (const auto& [block, counts] : blocks) {
    for (const UpsetOutcome outcome : tb::kUpsetOutcomes)
      rows.push_back({fmt::format("{}: {}", block, upset_outcome_name(outcome)),
                      static_cast<double>(counts[static_cast<std::size_t>(outcome)]),
                      "",
                      {},
                      {}});
  }
  rows.insert(rows.end(), found.begin(), found.end());
  unsigned total = 0;
  for (const UpsetOutcome outcome : tb::kUpsetOutcomes) {
    const unsigned count = all[static_cast<std::size_t>(outcome)];
    total += count;
    std::optional<double> at_most;
    if (outcome == UpsetOutcome::outside) at_most = 0.0;
    rows.push_back(
        {fmt::format("all: {}", upset_outcome_name(outcome)), static_cast<double>(count), "", {}, at_most});
  }
  rows.push_back({fmt::format("strikes ({} phases, 2 PWM settings)", tb::kUpsetPhases.size()),
                  static_cast<double>(total),
                  "",
                  1.0,
                  {}});
  return rows;
}

}  // namespace meltstage::app
