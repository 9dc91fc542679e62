// SPDX-License-Identifier: Apache-2.0
// The circuit of a compiled C++ module: what its functions compute (execution.hpp), by the flops and pins of
// its tables.
#pragma once

#include <llvm/IR/Module.h>

#include "hls/graph/circuit.hpp"

namespace meltstage::hls {

/// Translates the functions of interface.hpp. Throws UserError naming C++ file and line of
/// what it can't take.
Circuit translate(llvm::Module& module);

}  // namespace meltstage::hls
