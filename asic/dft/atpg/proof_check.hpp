// SPDX-License-Identifier: Apache-2.0
// Checks a refutation without trusting the solver that wrote it.
#pragma once

#include <string>
#include <string_view>

namespace meltstage::dft {

/// Whether the text DRAT proof refutes the DIMACS formula: every added clause must follow by unit propagation
/// (RUP), and the empty clause must be among them. Deletions are followed. `reason` says why not. Throws
/// UserError on text that is neither.
bool refutes(std::string_view cnf, std::string_view proof, std::string& reason);

}  // namespace meltstage::dft
