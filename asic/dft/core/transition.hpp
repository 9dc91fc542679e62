// SPDX-License-Identifier: Apache-2.0
// Transition faults, launch on capture: the scanned-in state is clocked twice at speed; the first clock
// launches the transition, the second captures what has become of it.
#pragma once

#include <string>
#include <vector>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/faults.hpp"

namespace meltstage::dft {

/// Both clocks as one circuit. Inputs are those of the capture view; ports keep their value over both clocks;
/// only flops are outputs, since a tester seldom strobes ports at speed. A slow-to-rise fault is "stuck" at 0
/// where it must have been 0 before. A line of the scan enable moves before the first clock: where it is too
/// slow for that, it is stuck at its shifting level there, and the launching clock shifts.
struct TransitionView {
  Circuit circuit;   ///< with the sites of the capture view, in the second clock
  FaultList faults;  ///< slow-to-rise (0) and slow-to-fall (1) of every site, collapsed along wires
  std::vector<Node> first_clock;   ///< by node of the capture view: its copy in the first clock
  std::vector<Node> second_clock;  ///< likewise in the second
};
/// `scan_enable`: the port that lets chains shift, held at its other level in the view; none where it is
/// empty.
TransitionView launch_on_capture(const CaptureView& view, const std::string& scan_enable = {});

/// As reported_classes(), for transition faults: those of the shift path that no capture can show are DI by
/// the chain test, which sends both transitions through every stage; faults outside the circuit (clock pins)
/// are left at UT.
std::vector<FaultClass> reported_transitions(const CaptureView& view, const TransitionView& transitions,
                                             const std::vector<FaultClass>& of_class);

/// "u_pwm.cnt_q_reg/D slow-to-rise".
std::string transition_name(const Circuit& circuit, std::size_t fault);

}  // namespace meltstage::dft
