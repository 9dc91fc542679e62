// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asic/netlist/liberty.hpp"

namespace meltstage::dft {

/// Yosys' own gates ($_AND_, $_DFF_PN0_ ...): asic/netlist/cells/yosys.lib, built in.
const CellLibrary& yosys_library();

}  // namespace meltstage::dft
