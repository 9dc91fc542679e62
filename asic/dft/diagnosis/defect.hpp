// SPDX-License-Identifier: Apache-2.0
// Defects that a chip may have, by the names in which people, fail logs and reports tell them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "asic/dft/core/circuit.hpp"

namespace meltstage::dft {

enum class DefectKind : std::uint8_t {
  stuck_at_0,
  stuck_at_1,
  slow_to_rise,  ///< a rising line has its new level one cycle late
  slow_to_fall,
  dominated_by,  ///< bridge: the line takes the level of the other one, which is the stronger
  wired_and,     ///< bridge: both lines are 1 only where both are driven to 1
  wired_or
};
const char* to_string(DefectKind kind);
bool is_bridge(DefectKind kind);

/// A line of the circuit: the output of a node (pin kStem) or one of its inputs.
struct Line {
  Node node = kNoNode;
  std::int32_t pin = kStem;
  friend bool operator==(const Line&, const Line&) = default;
  friend auto operator<=>(const Line&, const Line&) = default;
};

/// What is wrong with a chip. `other` is the second line of a bridge, an output of a node.
struct ChipDefect {
  DefectKind kind = DefectKind::stuck_at_0;
  Line line;
  Line other = {};
};

/// The node whose value a line carries.
Node source_of(const Circuit& circuit, const Line& line);
/// The line under one name: an input of a node whose driver feeds nothing else is that driver's output.
Line stem_of(const Circuit& circuit, const Line& line);

/// "u_pwm.cnt_q_reg/Q stuck-at-1", "u1/Y dominated-by u2/Y". Names are those of the circuit's sites.
/// Throws UserError for another form, a name that is no site, a site outside the circuit (a clock pin), or a
/// bridge of a line with itself or with one that depends on it.
ChipDefect parse_defect(const Circuit& circuit, std::string_view text);
std::string defect_name(const Circuit& circuit, const ChipDefect& defect);

/// By node, whether a change of `node` can move it; itself among them.
std::vector<bool> reached_from(const Circuit& circuit, Node node);
/// By node, whether its change can move `node`; itself among them.
std::vector<bool> cone_of(const Circuit& circuit, Node node);
/// Whether a change of `from` can move `to`.
bool leads_to(const Circuit& circuit, Node from, Node to);

}  // namespace meltstage::dft
