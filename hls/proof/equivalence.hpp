// SPDX-License-Identifier: Apache-2.0
// The question whether C++ and RTL are the same circuit, as one and-inverter graph.
//
// A clock of both begins in the same state with the same pins. A flop in reset shows its reset value at once,
// so the RTL works on what its flops show; the C++ does the same inside its step. To be shown for every state
// in which the invariants hold, and for all pins:
//
//   - each flop has the same next value; where the C++ keeps a bit constant, the RTL does;
//   - each output pin is the same in every state that flops show, which is the state after a clock too;
//   - each invariant holds in reset and in the next state again;
//   - each promise of the C++ is kept: nothing that C++ leaves undefined is reached, no number outgrows its
//     flop.
//
// By induction over clocks both are then equal for ever from reset on.
#pragma once

#include <string>
#include <vector>

#include "hls/graph/aig.hpp"
#include "hls/graph/circuit.hpp"
#include "hls/rtl/rtl.hpp"

namespace meltstage::hls {

enum class Kind { kFlop, kPin, kInvariant, kPromise };

/// A bit that has to be false.
struct Obligation {
  Kind kind;
  std::string name;   // of the flop's or pin's bit, of the invariant; what is promised, and where
  std::string block;  // the path of its instance
  Literal wrong;
  Literal of_model;  // the bit on both sides, for flops and pins
  Literal of_rtl;    //
};

struct Problem {
  Aig aig;
  Bits state;         // inputs of `aig`: flops of both sides
  Bits pins;          // those that only the RTL has, too: it must not depend on them
  Literal reachable;  // the invariants hold
  std::vector<Obligation> obligations;
};

/// How products of two variables are seen: as any function of their operands, which is enough for equality
/// and easy, or as they are.
enum class Products { kNamed, kInGates };

/// A pin that is tied to a value: both sides are compared with this value alone.
using TiedPins = std::unordered_map<std::string, bool>;

/// Throws UserError for a flop or pin of one side that the other one hasn't got.
Problem make_problem(const Circuit& model, const Rtl& rtl, Products products, const TiedPins& tied);

/// The same question of two ways to write the C++, beginning in the same state with the same pins: for every
/// state in which the invariants of `one` hold each flop has the same next value and each output pin is the
/// same. Throws UserError for a flop or pin of one side that the other one hasn't got.
Problem make_problem(const Circuit& one, const Circuit& other);

/// The question which bits of flops can switch: for each bit that rises, and for each that falls, in a clock
/// that begins in a state in which the invariants hold, and in which hls_in_reset() does not reset the flop.
/// What is wrong never happens where the answer holds. The invariants are asked with them, for all
/// values of the pins. `tied`: switches in clocks with this value of a pin alone. Throws UserError for a pin
/// that the circuit hasn't got.
Problem make_switches(Circuit model, const TiedPins& tied);

/// Adds what C++ compiled with Undefined::kTraps promises.
void add_promises(Problem& problem, const Circuit& trapped);

}  // namespace meltstage::hls
