// SPDX-License-Identifier: Apache-2.0
#include "app/print/report/decimate.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meltstage::app {
namespace {

constexpr std::size_t kKeptEnds = 2;
constexpr std::size_t kKeptPerChannel = 3;  // lowest, highest, gap

void keep_extremes(const std::vector<double>& values, std::size_t begin, std::size_t end,
                   std::vector<std::size_t>& kept) {
  std::size_t lowest = end, highest = end, gap = end;
  for (std::size_t i = begin; i < end; ++i) {
    if (std::isnan(values[i])) {
      gap = std::min(gap, i);
      continue;
    }
    if (lowest == end || values[i] < values[lowest]) lowest = i;
    if (highest == end || values[i] > values[highest]) highest = i;
  }
  for (std::size_t i : {lowest, highest, gap})
    if (i != end) kept.push_back(i);
}

}  // namespace

std::vector<std::size_t> decimate(std::span<const std::vector<double>> channels, std::size_t limit) {
  const std::size_t samples = channels.empty() ? 0 : channels.front().size();
  std::vector<std::size_t> kept;
  if (samples <= limit) {
    kept.resize(samples);
    std::iota(kept.begin(), kept.end(), std::size_t{0});
    return kept;
  }
  const std::size_t runs = std::max<std::size_t>(1, limit / (kKeptEnds + kKeptPerChannel * channels.size()));
  for (std::size_t run = 0; run < runs; ++run) {
    const std::size_t begin = run * samples / runs;
    const std::size_t end = (run + 1) * samples / runs;
    kept.push_back(begin);
    for (const auto& values : channels) keep_extremes(values, begin, end, kept);
    kept.push_back(end - 1);
  }
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  return kept;
}

}  // namespace meltstage::app
