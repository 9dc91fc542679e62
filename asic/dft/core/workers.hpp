// SPDX-License-Identifier: Apache-2.0
// Two threads at work on one circuit.
#pragma once

#include <thread>

#include "asic/dft/core/fault_simulator.hpp"

namespace meltstage::dft {

inline constexpr unsigned kWorkers = 2;

/// body(0) and body(1) at the same time.
template <class Body>
void in_parallel(const Body& body) {
  std::jthread other([&] { body(1U); });
  body(0U);
}

/// A block on two threads, each with fan-out-free regions of its own; the circuit must outlive it.
class ParallelFaultSimulator {
 public:
  explicit ParallelFaultSimulator(const Circuit& circuit) : workers_(kWorkers, FaultSimulator(circuit)) {}

  /// take(fault, patterns), in the order of `which`, for every fault at these positions that a pattern of the
  /// block detects.
  template <class Take>
  void detect(const PatternBlock& block, const std::vector<Fault>& faults,
              const std::vector<std::uint32_t>& which, const Take& take) {
    std::vector<std::uint32_t> part[kWorkers];
    for (const std::uint32_t i : which) part[worker_of(faults[i])].push_back(i);
    const std::vector<Word>* detected[kWorkers];
    in_parallel([&](unsigned w) { detected[w] = &workers_[w].detect(block, faults, part[w]); });
    std::size_t at[kWorkers] = {};
    for (const std::uint32_t i : which) {
      const unsigned w = worker_of(faults[i]);
      const Word& patterns = (*detected[w])[at[w]++];
      if (patterns.any()) take(i, patterns);
    }
  }

 private:
  // Regions that lie together share much of what a change runs through.
  unsigned worker_of(const Fault& fault) const { return workers_[0].root(fault.node) / 64 % kWorkers; }

  std::vector<FaultSimulator> workers_;
};

}  // namespace meltstage::dft
