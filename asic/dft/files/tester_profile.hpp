// SPDX-License-Identifier: Apache-2.0
// A tester's limits, as a person writes them down.
#pragma once

#include <filesystem>

#include "asic/dft/scan/lint.hpp"

namespace meltstage::dft {

/// TOML with every limit of a TesterProfile, times in ns, and a name. Throws UserError.
TesterProfile read_tester_profile(const std::filesystem::path& path);

}  // namespace meltstage::dft
