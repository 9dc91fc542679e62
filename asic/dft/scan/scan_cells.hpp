// SPDX-License-Identifier: Apache-2.0
// Cells of a library that scan insertion looks for, by what they do.
#pragma once

#include <optional>
#include <string>

#include "asic/netlist/liberty.hpp"

namespace meltstage::dft {

/// nullptr for a type that the library hasn't.
const Cell* find_cell(const CellLibrary& library, const std::string& type);

/// The pin that an expression is, inverted or not; "" when it is anything else.
std::string only_pin(const Expression& e);

struct MuxCell {
  const Cell* cell;
  std::string zero, one, select, out;
};

/// A library cell that is a two-way multiplexer. Throws UserError that names the netlist's `file`.
MuxCell find_mux(const CellLibrary& library, const std::string& file);

/// The smallest buffer of a library, with its input and output; nothing when it has none.
struct BufferCell {
  const Cell* cell;
  std::string in, out;
};
std::optional<BufferCell> find_buffer(const CellLibrary& library);

/// The scan cell that does what `flop` does: same pins and state, plus scan-in and enable.
const Cell* scan_form(const CellLibrary& library, const Cell& plain);

/// The clock gate that does what `plain` does and has a test enable.
const Cell* testable_form(const CellLibrary& library, const Cell& plain);

}  // namespace meltstage::dft
