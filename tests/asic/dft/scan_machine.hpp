// SPDX-License-Identifier: Apache-2.0
// Small circuits with scan chains and their test sets.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "asic/dft/atpg/generate.hpp"
#include "asic/dft/files/stil.hpp"
#include "asic/dft/scan/scan.hpp"
#include "asic/dft/scan/scan_test.hpp"
#include "tests/asic/dft/support.hpp"

namespace meltstage::dft {

struct Machine {
  Machine(const std::string& name, const CellLibrary& library)
      : cells(library), plain(circuit_netlist(name)) {}

  const CellLibrary& cells;
  Netlist plain;
  ScanDesign design = insert_scan(plain, cells, {.chains = 2});
  CaptureView view = scan_view(design, cells);
  CaptureView free_view = capture_view(design.netlist, cells);
  TestSet set = generate_tests(view.circuit);
  ScanTest test = make_scan_test(design, view, set.patterns, "machine");
  // as written and read back
  CycleStream stream = parse_stil(stil_text(test), "machine.stil");
};

inline const Machine& machine() {
  static const Machine the_machine("machine", mini_library());
  return the_machine;
}

inline bool same_chains(const std::vector<ScanChain>& a, const std::vector<ScanChain>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const ScanChain& x, const ScanChain& y) {
    return x.name == y.name && x.in == y.in && x.out == y.out && x.cells == y.cells;
  });
}

inline const Machine& gated() {
  static const Machine the_machine("gated", mini_library());
  return the_machine;
}

}  // namespace meltstage::dft
