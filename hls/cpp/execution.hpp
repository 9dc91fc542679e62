// SPDX-License-Identifier: Apache-2.0
// A function as it is executed for every state and input at once: every path is followed, values of different
// paths meet in selects, memory is a value too, loops are unrolled while their end is known.
#pragma once

#include <llvm/IR/Function.h>

#include <vector>

#include "hls/cpp/findings.hpp"
#include "hls/cpp/memory.hpp"
#include "hls/graph/circuit.hpp"
#include "hls/graph/graph.hpp"

namespace meltstage::hls {

/// Memory after the function has returned; its arguments point to the objects of `memory`, one each. Adds to
/// what the C++ promises and leaves open.
Memory execute(Graph& graph, std::vector<Promise>& promises, OpenValues& opens, llvm::Function& function,
               Memory memory);

}  // namespace meltstage::hls
