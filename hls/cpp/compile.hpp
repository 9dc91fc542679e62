// SPDX-License-Identifier: Apache-2.0
// C++ sources to one LLVM module in which each of the circuit's functions stands alone, without calls.
#pragma once

#include <llvm/IR/LLVMContext.h>
#include <llvm/IR/Module.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace meltstage::hls {

struct Sources {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> options;  // of the compiler: -I, -D
};

/// What C++ leaves undefined becomes a place that is never reached in the one, and is left to the compiler in
/// the other: the first shows what the C++ promises, the second is the circuit. In the first a local begins
/// with the result of a call of kOpenLocal BITS.NAME.
enum class Undefined { kTraps, kIsLeft };

inline constexpr const char* kOpenLocal = "hls_open.";
/// Named metadata of a module that was compiled with Undefined::kTraps.
inline constexpr const char* kShowsPromises = "hls.promises";

/// Throws UserError with the compiler's first message when it refuses a file.
std::unique_ptr<llvm::Module> compile(const Sources& sources, Undefined undefined,
                                      llvm::LLVMContext& context);

}  // namespace meltstage::hls
