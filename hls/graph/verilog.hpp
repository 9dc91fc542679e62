// SPDX-License-Identifier: Apache-2.0
// The circuit as SystemVerilog.
#pragma once

#include <ostream>
#include <string>

#include "hls/graph/circuit.hpp"

namespace meltstage::hls {

/// Module `name`: ports clk_i, rst_ni and the pins; flops under their names, in named blocks where a name has
/// dots, reset at once while rst_ni is low or hls_in_reset() says so. An input pin rst_ni is that port.
void write_verilog(Circuit circuit, const std::string& name, std::ostream& out);

}  // namespace meltstage::hls
