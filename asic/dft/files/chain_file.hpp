// SPDX-License-Identifier: Apache-2.0
// Where scan chains stand, for patterns that don't tell it: a scan.json of `dft generate` or `dft scan`.
#pragma once

#include <filesystem>
#include <vector>

#include "asic/dft/core/cycles.hpp"

namespace meltstage::dft {

/// JSON with "chains", each of name, in, out and cells. Throws UserError.
std::vector<ScanChain> read_chain_file(const std::filesystem::path& path);

}  // namespace meltstage::dft
