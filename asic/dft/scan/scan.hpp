// SPDX-License-Identifier: Apache-2.0
// Scan on the netlist: flops become scan flops in balanced chains, resets that logic drives get a bypass,
// clock gates open in shift, test ports are added.
#pragma once

#include <string>
#include <vector>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/cycles.hpp"

namespace meltstage::dft {

/// Ports of these names that the netlist has are used; those it hasn't are added.
struct ScanOptions {
  std::size_t chains = 8;  ///< unless the netlist has scan_in or scan_out, whose width it is then
  std::string test_mode = "test_mode_i";
  std::string scan_enable = "scan_en_i";
  std::string scan_in = "scan_i";   ///< bus, a bit a chain
  std::string scan_out = "scan_o";  ///< likewise
  std::string reset = {};  ///< input port that resets in test mode; empty: the one that resets flops directly
};

struct ScanDesign {
  Netlist netlist;
  std::vector<ScanChain> chains;
  std::string test_mode, scan_enable;
  std::string reset;  ///< port bit, empty when no flop has a reset
  bool reset_low = true;
  std::string clock;  ///< port bit
};

/// A breach of the rules that scan asks for; `offender` is the cell or net.
struct RuleViolation {
  std::string rule;
  std::string offender;
  std::string text;
};

/// All breaches at once: clocks not from one port, clock gates that the scan enable doesn't open, resets from
/// logic that the test mode doesn't bypass, flops without a reset, latches, loops, undriven and twice driven
/// nets, pins that are not connected or that the cell doesn't have, unknown cells and those of which the
/// library says what has no meaning. Where none of these keeps tests from being generated, whatever else
/// does.
std::vector<RuleViolation> check_rules(const Netlist& netlist, const CellLibrary& library,
                                       const ScanOptions& options = {});

/// Inserts scan: each flop becomes the library's scan flop of the same function, or gets a multiplexer before
/// its D pin where there is none, unless it takes over the state of the flop before it while shifting anyway.
/// Chains differ by one cell at the most and follow the names, so that neighbours lie in one chain. A reset
/// from logic is switched to the reset port in test mode, unless the netlist does so already; clock gates get
/// the scan enable as their test enable. Throws UserError that names the cell when a rule that can't be
/// mended is broken.
ScanDesign insert_scan(const Netlist& netlist, const CellLibrary& library, const ScanOptions& options = {});

/// Chains of a scanned netlist, found by following each bit of its scan output back while scan is enabled.
/// Throws UserError that names the cell where a chain breaks.
std::vector<ScanChain> trace_chains(const Netlist& netlist, const CellLibrary& library,
                                    const ScanOptions& names = {});

/// Throws UserError that names the first cell of the stream's chains that stands otherwise than `netlist`,
/// the view's file, shifts, or a flop that is in none of them. `view`: with nothing held.
void require_chains(const CycleStream& stream, const CaptureView& view, const std::string& netlist,
                    const ScanOptions& names = {});

/// A netlist that has scan already, as `dft generate` writes it. `view`: with nothing held. Throws UserError
/// when it has no test mode or scan enable.
ScanDesign scanned_design(const Netlist& netlist, const CaptureView& view, std::vector<ScanChain> chains);

/// Values that the ports of a scan design hold while it captures.
HeldPorts capture_holds(const ScanDesign& design);

/// The capture view of a scan design, with the lines marked that lie on the way from flop to flop while it
/// shifts.
CaptureView scan_view(const ScanDesign& design, const CellLibrary& library);

}  // namespace meltstage::dft
