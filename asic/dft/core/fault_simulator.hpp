// SPDX-License-Identifier: Apache-2.0
// Parallel-pattern single-fault propagation: 512 patterns at once. Inside a fan-out-free region faults are
// traced to its root, the branching line, by the gates on the way; from the outputs backwards a change of
// each root is propagated event by event, in the patterns in which a fault of the region reaches it, until it
// has died, reached outputs, or narrowed to one line that has been looked at in these patterns. After
// Waicukauski et al., "Fault simulation for structured VLSI", VLSI Systems Design 1985, with critical-path
// tracing inside fan-out-free regions (Abramovici et al. 1984).
#pragma once

#include <cstdint>
#include <vector>

#include "asic/dft/core/faults.hpp"
#include "asic/dft/core/patterns.hpp"
#include "base/progress.hpp"

namespace meltstage::dft {

/// Values of every node for one block.
void simulate(const Circuit& circuit, const PatternBlock& block, std::vector<Word>& values);

/// The same where the inputs stand in `values` already.
void simulate_values(const Circuit& circuit, std::vector<Word>& values);
/// The same with one line stuck, in every pattern.
void simulate_faulty(const Circuit& circuit, const Fault& fault, std::vector<Word>& values);

/// One worker's memory; the circuit must outlive it.
class FaultSimulator {
 public:
  explicit FaultSimulator(const Circuit& circuit);

  /// Which patterns of the block detect each of the faults at positions `which`, in their order; unused lanes
  /// are 0. Holds until the next call.
  const std::vector<Word>& detect(const PatternBlock& block, const std::vector<Fault>& faults,
                                  const std::vector<std::uint32_t>& which);

  /// Which patterns excite each fault and carry it through the gate that its line feeds (pseudo-stuck-at, for
  /// supply current measurement).
  void detect_at_gate(const PatternBlock& block, const std::vector<Fault>& faults,
                      std::vector<Word>& detected);

  /// Values of the fault-free circuit of the last block.
  const std::vector<Word>& values() const { return values_; }
  /// The branching line or output that a node alone leads to; itself where it branches.
  Node root(Node node) const { return root_[node]; }

 private:
  const Circuit& circuit_;
  std::vector<Node> root_;
  std::vector<Word> values_;
  std::vector<Word> observable_;      // of a root, at an output, where reaching_; of others, at their root
  std::vector<Word> reaching_;        // of a root, where a fault reaches it
  std::vector<std::uint8_t> needed_;  // a fault of `which` passes here on the way to its root
  std::vector<Word> faulty_, detected_;
  std::vector<std::uint32_t> stamp_;
  std::vector<std::uint64_t> pending_;
  std::uint32_t now_ = 0;
};

/// 0 .. count - 1: all faults of a list.
std::vector<std::uint32_t> every(std::size_t count);

/// Grading without dropping: in `first_pattern` the first pattern that detects each fault (kUndetected for
/// none), in `detections` how many do. Blocks are shared between `threads` threads.
struct Grade {
  static constexpr std::uint32_t kUndetected = ~std::uint32_t{0};
  std::vector<std::uint32_t> first_pattern;
  std::vector<std::uint32_t> detections;
};
Grade grade(const Circuit& circuit, const std::vector<PatternBlock>& blocks, const std::vector<Fault>& faults,
            unsigned threads, const Progress& progress = {});

}  // namespace meltstage::dft
