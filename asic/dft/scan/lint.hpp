// SPDX-License-Identifier: Apache-2.0
// Whether a tester can run a stream.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/core/cycles.hpp"

namespace meltstage::dft {

/// What a tester can do. Defaults are those of a small digital tester.
struct TesterProfile {
  std::string name = "default";
  double least_period_ns = 10;
  double edge_resolution_ns = 1;
  double least_pulse_ns = 5;
  std::uint64_t vector_memory = 64'000'000;
  std::uint64_t pins = 256;
};

/// Reasons why it can't; empty when it can. Each is one line: found, expected.
std::vector<std::string> lint(const CycleStream& stream, const TesterProfile& profile);

}  // namespace meltstage::dft
