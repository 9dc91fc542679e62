// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/end_writes.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include "base/rng.hpp"
#include "tb/lockstep/register_ends.hpp"
#include "tb/stimulus/random_requests.hpp"

namespace meltstage::tb {

namespace {

struct Write {
  unsigned index;
  RegisterEnd end;
  std::uint16_t word;
};

std::vector<Write> all_writes(Rng& rng) {
  std::vector<Write> writes;
  for (unsigned index = spec::kRegCmd + 1u; index < spec::kHoldingCount; ++index)
    for (const RegisterEnd end :
         {RegisterEnd::lowest, RegisterEnd::highest, RegisterEnd::below, RegisterEnd::above})
      if (const auto word = end_word(index, end)) writes.push_back({index, end, *word});
  for (std::size_t left = writes.size(); left > 1; --left)
    std::swap(writes[left - 1], writes[rng.below(left)]);
  return writes;
}

// By function 06 or 16.
ModbusResult written(Bench& bench, Rng& rng, unsigned index, std::uint16_t word) {
  const auto reg = static_cast<spec::Reg>(index);
  return one_in(rng, 2) ? bench.write(reg, word) : bench.write_block(reg, {word});
}

void demand(bool met, const Write& write, std::string_view expected) {
  if (!met)
    throw std::runtime_error(fmt::format("{}: {} was written, expected it {}",
                                         spec::kHolding[write.index].name, write.word, expected));
}

void carry_out(Bench& bench, Rng& rng, const Write& write) {
  if (write.index == spec::kRegSetpoint)  // which has to lie below the highest temperature
    bench.write(spec::kRegTMax, static_cast<std::uint16_t>(spec::kHolding[spec::kRegTMax].max));
  const ModbusResult result = written(bench, rng, write.index, write.word);
  if (write.end == RegisterEnd::below || write.end == RegisterEnd::above) {
    demand(result.exception_code == spec::kExcValue, write, "refused");
  } else {
    demand(result.outcome == ModbusOutcome::data, write, "taken");
    demand(bench.read_holding(write.index, 1)[0] == write.word, write, "read back");
  }
}

}  // namespace

chip::Chip end_writes_start() { return chip_with(quick()); }

EndWrites write_register_ends(std::unique_ptr<Device> device, std::uint64_t seed, std::uint64_t passes) {
  Rng rng(seed, "register ends");
  Bench bench(std::move(device), "MAX31855", seed);
  bench.next_tick();
  for (std::uint64_t pass = 0; pass < passes; ++pass) {
    bench.command(spec::kCmdHold);
    for (const Write& write : all_writes(rng)) carry_out(bench, rng, write);
    bench.command(spec::kCmdDiscard);
  }
  return {bench.coverage(), bench.finish()};
}

}  // namespace meltstage::tb
