// SPDX-License-Identifier: Apache-2.0
// The question whether the chip's RTL is its model, where bug_i chooses one of many variants of the RTL
// (tests/proofs/mutation/variants.py).
#pragma once

#include <fmt/format.h>
#include <llvm/IR/LLVMContext.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>

#include "base/file.hpp"
#include "base/temporary_folder.hpp"
#include "hls/cpp/compile.hpp"
#include "hls/cpp/translate.hpp"
#include "hls/proof/equivalence.hpp"
#include "hls/rtl/rtl.hpp"

namespace meltstage::tests {

inline constexpr const char* kChoice = "bug_i";  ///< pin that only the variants have
inline constexpr unsigned kChoiceBits = 16;

/// The model of cmodel/ below `root`.
inline hls::Circuit model_in(const std::filesystem::path& root) {
  hls::Sources sources;
  for (const auto& entry : std::filesystem::directory_iterator(root / "cmodel"))
    if (entry.path().extension() == ".cpp") sources.files.push_back(entry.path());
  sources.files.emplace_back(root / "hls/chip/clock.cpp");
  sources.options = {"-I" + root.string()};
  llvm::LLVMContext context;
  return hls::translate(*hls::compile(sources, hls::Undefined::kIsLeft, context));
}

/// Whether a variant is there, said for good; nothing where bug_i still chooses it.
using Fixed = std::function<std::optional<bool>(unsigned variant)>;

/// Text of the RTL with `bug_i == 16'dN` and `bug_i != 16'dN` in words of what is fixed.
inline std::string with_fixed(const std::string& text, const Fixed& fixed) {
  const std::string choice = fmt::format("{} ", kChoice), number_begins = fmt::format("= {}'d", kChoiceBits);
  std::string result;
  std::size_t done = 0;
  for (std::size_t at = 0; (at = text.find(choice, done)) != std::string::npos;) {
    const std::size_t sign = at + choice.size(), digits = sign + 1 + number_begins.size();
    result += text.substr(done, at - done);
    done = sign;
    if (text.compare(sign + 1, number_begins.size(), number_begins) != 0) {
      result += choice;
      continue;
    }
    std::size_t end = digits;
    while (std::isdigit(static_cast<unsigned char>(text[end])) != 0) ++end;
    const std::optional<bool> there =
        fixed(static_cast<unsigned>(std::stoul(text.substr(digits, end - digits))));
    if (!there) {
      result += choice;
      continue;
    }
    result += *there == (text[sign] == '=') ? "1'b1" : "1'b0";
    done = end;
  }
  return result + text.substr(done);
}

/// The RTL of `folder`, in which bug_i chooses what is not fixed.
inline hls::Rtl variants_in(const std::filesystem::path& folder, const Fixed& fixed) {
  const TemporaryFolder copy;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!entry.path().extension().string().starts_with(".sv")) continue;
    std::ofstream(copy.path() / entry.path().filename())
        << with_fixed(read_file(entry.path(), "RTL with variants"), fixed);
  }
  hls::RtlSources sources = hls::read_file_list(MELTSTAGE_SOURCE_DIR "/rtl/tc.f", "tc_top");
  for (std::filesystem::path& file : sources.files) file = copy.path() / file.filename();
  sources.include_folders = {copy.path()};
  return hls::read_rtl(sources);
}

inline hls::Problem question(const hls::Circuit& model, const hls::Rtl& rtl) {
  return hls::make_problem(model, rtl, hls::Products::kInGates, {{"scan_en_i", false}});
}

}  // namespace meltstage::tests
