// SPDX-License-Identifier: Apache-2.0
// Parallel-pattern single-fault propagation: 512 patterns at once. The observability of a line (in which
// patterns a change of it reaches an output) is found from the outputs backwards: lines without branches take
// it from the gate they feed; a change of a branching line is propagated event by event until it has died,
// reached outputs, or narrowed to one line whose observability is known. After Waicukauski et al., "Fault
// simulation for structured VLSI", VLSI Systems Design 1985, with critical-path tracing inside fan-out-free
// regions (Abramovici et al. 1984).
#pragma once

#include <cstdint>
#include <vector>

#include "asic/dft/faults.hpp"
#include "asic/dft/patterns.hpp"

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

  /// Which patterns of the block detect each fault of `faults`; one word a fault, unused lanes 0. Faults with
  /// alive[i] == 0 are left out (their word is 0). Both vectors have the same length.
  void detect(const PatternBlock& block, const std::vector<Fault>& faults,
              const std::vector<std::uint8_t>& alive, std::vector<Word>& detected);

  /// Which patterns excite each fault and carry it through the gate that its line feeds (pseudo-stuck-at, for
  /// supply current measurement).
  void detect_at_gate(const PatternBlock& block, const std::vector<Fault>& faults,
                      std::vector<Word>& detected);

  /// Values of the fault-free circuit of the last block.
  const std::vector<Word>& values() const { return values_; }

 private:
  const Circuit& circuit_;
  std::vector<Word> values_;
  std::vector<Word> observable_;
  std::vector<std::uint8_t> known_;   // observable_ holds for this block
  std::vector<std::uint8_t> needed_;  // a fault that is alive needs it
  std::vector<Word> faulty_;
  std::vector<std::uint32_t> stamp_;
  std::vector<std::uint64_t> pending_;
  std::uint32_t now_ = 0;
};

/// Grading without dropping: in `first_pattern` the first pattern that detects each fault (kUndetected for
/// none), in `detections` how many do. Blocks are shared between `threads` threads.
struct Grade {
  static constexpr std::uint32_t kUndetected = ~std::uint32_t{0};
  std::vector<std::uint32_t> first_pattern;
  std::vector<std::uint32_t> detections;
};
Grade grade(const Circuit& circuit, const std::vector<PatternBlock>& blocks, const std::vector<Fault>& faults,
            unsigned threads);

/// Every node's value, every gate evaluated by its definition, with a line stuck or (nullptr) without. Slow.
std::vector<bool> serial_values(const Circuit& circuit, const Pattern& pattern, const Fault* fault);
/// The oracle: one fault, one pattern, every gate evaluated by its definition. For tests; slow.
bool serial_detects(const Circuit& circuit, const Pattern& pattern, const Fault& fault);

}  // namespace meltstage::dft
