// SPDX-License-Identifier: Apache-2.0
// .bench: the netlist format of ISCAS-85, ISCAS-89 and ITC'99.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "asic/dft/core/circuit.hpp"

namespace meltstage::dft {

/// Reads an ISCAS/ITC netlist; DFFs become inputs and outputs of the circuit. Fault sites are its lines: each
/// gate output or input, and each branch of a line that feeds more than one place. Throws UserError with
/// file, line and column.
Circuit read_bench(const std::filesystem::path& path);
/// The same from text; `name` stands in messages.
Circuit parse_bench(std::string_view text, const std::string& name);

}  // namespace meltstage::dft
