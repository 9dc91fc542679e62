// SPDX-License-Identifier: Apache-2.0
#include "asic/netlist/yosys_library.hpp"

#include "cells.hpp"

namespace meltstage::dft {

const CellLibrary& yosys_library() {
  static const CellLibrary library = parse_liberty(cells::kYosys, "yosys.lib");
  return library;
}

}  // namespace meltstage::dft
