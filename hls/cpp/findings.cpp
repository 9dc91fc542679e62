// SPDX-License-Identifier: Apache-2.0
#include "hls/cpp/findings.hpp"

#include <fmt/format.h>
#include <llvm/IR/DebugInfoMetadata.h>

#include <utility>

#include "base/error.hpp"

namespace meltstage::hls {

Place place_of(const llvm::Instruction& instruction) {
  const llvm::DILocation* at = instruction.getDebugLoc().get();
  if (at == nullptr) return {};
  // A fault in the library is told where the person's own file called it.
  while (at->getInlinedAt() != nullptr && at->getFilename().startswith("/usr/")) at = at->getInlinedAt();
  return {at->getFilename().str(), at->getLine()};
}

void refuse(const Place& place, const std::string& what) {
  if (place.line == 0) throw UserError(fmt::format("hls: {}", what));
  throw UserError(fmt::format("{}:{}: {}", place.file, place.line, what));
}

void Findings::at(const llvm::Instruction& instruction) {
  if (const Place place = place_of(instruction); place.line != 0) {
    here_ = place;
    graph_.at(place);
  }
}

void Findings::promise(std::vector<Promise>& promises) const {
  for (const Trap& trap : traps_) {
    const Node there = graph_.both(trap.broken, paths_.reached(trap.executed));
    if (!graph_.is_zero(there)) promises.push_back({there, trap.what, trap.place});
  }
}

Node Findings::open(unsigned width, std::string of) {
  const Node node = graph_.any(width);
  opens_.values.push_back({node, std::move(of), here_});
  return node;
}

void Findings::read(Node byte) {
  if (graph_[byte].op == Op::kAny) opens_.reads.try_emplace(byte, here_);
}

}  // namespace meltstage::hls
