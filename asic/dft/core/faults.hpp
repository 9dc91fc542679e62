// SPDX-License-Identifier: Apache-2.0
// Stuck-at faults of a circuit: the list of what is reported, collapsed into classes of faults that no test
// can tell apart.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "asic/dft/core/circuit.hpp"

namespace meltstage::dft {

/// Fault classes under the names that commercial tools use.
enum class FaultClass : std::uint8_t {
  NO,  ///< not observed yet (at the start all are)
  NC,  ///< not controlled: no pattern so far sets the line opposite to the fault
  DS,  ///< detected by simulation
  DI,  ///< detected by implication (chain or reset test)
  PT,  ///< possibly detected (unknown value at the output)
  UT,  ///< untestable: tied, unused or unobservable by structure
  UR,  ///< untestable: redundant, with a proof
  AU   ///< ATPG untestable: only because of values held in test
};
inline constexpr std::size_t kFaultClasses = 8;
const char* to_string(FaultClass c);

/// A line of the circuit: the output of a node (pin kStem) or one of its inputs; stuck at a value.
struct Fault {
  Node node = kNoNode;
  std::int32_t pin = kStem;
  bool stuck = false;
  /// Where it isn't kNoNode, a test must also set this node to `stuck`: the line before a transition.
  Node launch = kNoNode;

  friend bool operator==(const Fault&, const Fault&) = default;
};

/// The reported faults: two for every site, site 0 stuck-at-0 first.
struct FaultList {
  std::vector<Fault> classes;           ///< one representative of each equivalence class
  std::vector<std::uint32_t> class_of;  ///< class of fault 2 * site + stuck; kNoClass outside the circuit
  static constexpr std::uint32_t kNoClass = ~std::uint32_t{0};

  std::size_t total() const { return class_of.size(); }
};

/// Joins faults that are equivalent by structure: a controlling input of a gate and its output, both faults
/// of buffers, inverters and lines without branches.
FaultList collapse(const Circuit& circuit);
/// Joins only what holds for transitions, too: both ends of buffers, inverters and lines without branches.
FaultList collapse_along_wires(const Circuit& circuit);

/// Counts over the reported (uncollapsed) faults.
struct Coverage {
  std::array<std::size_t, kFaultClasses> count{};
  std::size_t collapsed = 0;

  std::size_t of(FaultClass c) const { return count[static_cast<std::size_t>(c)]; }
  std::size_t total() const;
  std::size_t detected() const { return of(FaultClass::DS) + of(FaultClass::DI); }
  std::size_t undetectable() const { return of(FaultClass::UT) + of(FaultClass::UR); }
  double test_coverage() const;     ///< detected / (total - undetectable), 0..1
  double fault_coverage() const;    ///< detected / total
  double fault_efficiency() const;  ///< (detected + undetectable + AU) / total
};

/// The class of every fault from those of the equivalence classes; faults outside the circuit are UT.
std::vector<FaultClass> reported_classes(const FaultList& list, const std::vector<FaultClass>& of_class);
Coverage coverage(const FaultList& list, const std::vector<FaultClass>& reported);

/// "u_pwm.cnt_q_reg/D stuck-at-1".
std::string fault_name(const Circuit& circuit, std::size_t fault);

}  // namespace meltstage::dft
