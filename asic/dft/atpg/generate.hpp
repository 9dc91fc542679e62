// SPDX-License-Identifier: Apache-2.0
// A compact set of stuck-at tests with a verdict on every fault.
#pragma once

#include <cstdint>
#include <vector>

#include "asic/dft/core/faults.hpp"
#include "asic/dft/core/patterns.hpp"
#include "base/progress.hpp"

namespace meltstage::dft {

struct GenerateOptions {
  std::uint64_t seed = 1;
  std::uint32_t conflict_limit = 0;  ///< of a single solver call; 0: none, so that no fault is given up
  unsigned compaction_passes = 3;
  Progress progress = {};
};

/// What a step of generation took: time, and processor time of all threads of the program.
struct StepTime {
  const char* name;
  double wall_s, processor_s;
};

struct TestSet {
  std::vector<Pattern> patterns;
  FaultList faults;
  std::vector<FaultClass> of_class;  ///< by equivalence class
  std::size_t aborted = 0;           ///< classes the solver gave up
  std::size_t solver_calls = 0;
  std::size_t before_compaction = 0;  ///< patterns
  std::vector<StepTime> steps;
};

/// Generates tests: random patterns tell hard faults from easy ones; each hard fault gets a cube from the
/// solver, cubes that don't contradict each other are merged, filled at random and simulated; patterns that
/// the rest makes superfluous are dropped in reverse and shuffled order. The result depends on circuit and
/// options alone, not on timing.
TestSet generate_tests(const Circuit& circuit, const GenerateOptions& options = {});
/// The same for given faults.
TestSet generate_tests(const Circuit& circuit, FaultList faults, const GenerateOptions& options);

/// Drops patterns without which every fault of `faults` that was detected still is.
std::vector<Pattern> compact(const Circuit& circuit, std::vector<Pattern> patterns,
                             const std::vector<Fault>& faults, std::uint64_t seed, unsigned passes,
                             const Progress& progress = {});

}  // namespace meltstage::dft
