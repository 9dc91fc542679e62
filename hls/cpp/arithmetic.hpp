// SPDX-License-Identifier: Apache-2.0
// Instructions and intrinsics that only compute, as nodes of the graph.
#pragma once

#include <llvm/ADT/STLExtras.h>
#include <llvm/IR/InstrTypes.h>
#include <llvm/IR/Instruction.h>
#include <llvm/IR/IntrinsicInst.h>

#include <vector>

#include "hls/graph/graph.hpp"

namespace meltstage::hls {

Node arithmetic(Graph& graph, llvm::Instruction::BinaryOps code, Node a, Node b);
Node comparison(Graph& graph, llvm::CmpInst::Predicate predicate, Node a, Node b);

/// The parts of an intrinsic's result, `operand` giving its whole numbers; none when it has no circuit here.
std::vector<Node> intrinsic(Graph& graph, const llvm::IntrinsicInst& call,
                            llvm::function_ref<Node(unsigned)> operand);

}  // namespace meltstage::hls
