// SPDX-License-Identifier: Apache-2.0
// What test generation needs of a Liberty file: the function of each output, flops, scan cells (test_cell).
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace meltstage::dft {

/// A Boolean expression of Liberty's `function` attribute.
struct Expression {
  enum class Op { zero, one, pin, inv, all, any, parity };  ///< all: AND, any: OR, parity: XOR
  Op op = Op::zero;
  std::string pin;               ///< Op::pin only
  std::vector<Expression> args;  ///< one for inv, two or more for all, any, parity

  friend bool operator==(const Expression&, const Expression&) = default;
};

/// Whether it is a pin or its inverse: what an edge or a level of one pin can be.
bool is_pin_or_inverse(const Expression& e);

/// Parses one expression (`!`, postfix `'`, `^`, `&` `*` or a blank, `|` `+`, parentheses; in falling
/// precedence). Throws UserError with the position counted from 1.
Expression parse_expression(std::string_view text);

/// The `ff` group: an edge-triggered flop.
struct Flop {
  std::string state;    ///< IQ
  std::string state_n;  ///< IQN
  Expression next_state;
  Expression clocked_on;
  std::optional<Expression> clear;   ///< true: state is 0
  std::optional<Expression> preset;  ///< true: state is 1
  /// What `state` and `state_n` are while both are true, as Liberty writes it: L, H, N, T or X.
  char state_of_both = 'X', state_n_of_both = 'X';

  friend bool operator==(const Flop&, const Flop&) = default;
};

struct CellPin {
  std::string name;
  bool is_output = false;
  std::optional<Expression> function;  ///< outputs; may name the flop's state

  friend bool operator==(const CellPin&, const CellPin&) = default;
};

/// Pins of a scan flop, from the signal_type of its test_cell or the nextstate_type of its pins.
struct ScanPins {
  std::string in;
  std::string enable;
  bool enable_low = false;  ///< shifts while the enable is 0
  Expression next_state;    ///< what it captures outside shift

  friend bool operator==(const ScanPins&, const ScanPins&) = default;
};

/// An integrated clock gate with a latch that is open while the clock is low: `out` pulses with the clock
/// when `enable` or `test` was 1 before its rise.
struct ClockGate {
  std::string clock, enable, out;
  std::string test;  ///< empty when it has none

  friend bool operator==(const ClockGate&, const ClockGate&) = default;
};

struct Cell {
  std::string name;
  double area = 0.0;
  std::vector<CellPin> pins;  ///< without supply pins
  std::optional<Flop> flop;
  std::optional<ScanPins> scan;
  std::optional<ClockGate> gate;
  bool has_latch = false;  ///< other than a clock gate's
  std::string where;       ///< FILE:LINE:COLUMN
  /// What the library says of it that has no meaning here, in one line with its place: three_state, a
  /// function that names no pin. It matters where the cell is used; empty: nothing.
  std::string defect;

  const CellPin* find(std::string_view pin) const;
};

using CellLibrary = std::map<std::string, Cell, std::less<>>;

/// Reads a Liberty file. Cells whose outputs have no function are kept without one. Throws UserError, also
/// for a cell, pin or statement that is said twice with another meaning.
CellLibrary read_liberty(const std::filesystem::path& path);
/// The same from text; `name` stands in messages.
CellLibrary parse_liberty(std::string_view text, const std::string& name);

}  // namespace meltstage::dft
