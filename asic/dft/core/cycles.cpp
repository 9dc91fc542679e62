// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/cycles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/error.hpp"

namespace meltstage::dft {

bool is_plain_name(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return c > ' ' && c <= '~' && std::string_view("\"'\\%`").find(c) == std::string_view::npos;
  });
}

std::vector<std::uint8_t> ScanChain::inverses() const {
  std::vector<std::uint8_t> result(cells.size() + 1, 0);
  for (const std::size_t first : inversions) {
    for (std::size_t cell = first; cell < result.size(); ++cell) result[cell] ^= 1U;
  }
  return result;
}

std::uint64_t cycle_count(const CycleStream& stream) {
  std::uint64_t count = 0;
  for (const TestCycle& cycle : stream.cycles) count += cycle.count;
  return count;
}

CycleStream unrolled(CycleStream stream) {
  const std::uint64_t total = cycle_count(stream);
  if (total > std::min(kMostCycles, kMostStates / std::max<std::size_t>(1, stream.signals.size())))
    throw UserError(fmt::format("{}: found {} cycles of {} signals, expected at most {} cycles and {} states",
                                stream.title, total, stream.signals.size(), kMostCycles, kMostStates));
  std::vector<TestCycle> single;
  single.reserve(total);
  for (TestCycle& cycle : stream.cycles) {
    const std::uint64_t count = std::exchange(cycle.count, 1);
    single.push_back(cycle);
    cycle.label.clear();
    for (std::uint64_t i = 1; i < count; ++i) single.push_back(cycle);
  }
  stream.cycles = std::move(single);
  return stream;
}

bool same_cycles(const CycleStream& a, const CycleStream& b) {
  if (a.signals != b.signals || a.timing != b.timing || cycle_count(a) != cycle_count(b)) return false;
  std::uint64_t left_a = 0, left_b = 0;
  for (std::size_t i = 0, k = 0;;) {
    if (i == a.cycles.size() || k == b.cycles.size()) return true;  // as many cycles: both end here
    if (a.cycles[i].states != b.cycles[k].states) return false;
    if (left_a == 0) left_a = a.cycles[i].count;
    if (left_b == 0) left_b = b.cycles[k].count;
    const std::uint64_t both = std::min(left_a, left_b);
    if ((left_a -= both) == 0) ++i;
    if ((left_b -= both) == 0) ++k;
  }
}

}  // namespace meltstage::dft
