// SPDX-License-Identifier: Apache-2.0
// Checks a refutation without trusting the solver that wrote it.
#pragma once

#include <string>

namespace meltstage::dft {

/// A file's text, and its name for messages.
struct ProofFile {
  std::string name, text;
};

/// Whether the text DRAT proof refutes the DIMACS formula: every added clause must follow by unit propagation
/// (RUP), and the empty clause must be among them. Deletions are followed. `reason` says why not. Throws
/// UserError, with name, line and column, on text that is neither.
bool refutes(const ProofFile& cnf, const ProofFile& proof, std::string& reason);

}  // namespace meltstage::dft
