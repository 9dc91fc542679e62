// SPDX-License-Identifier: Apache-2.0
// Where a bench finds the files that it reads: by the place of its own program, wherever that was copied to.
#pragma once

#include <filesystem>
#include <string>

namespace meltstage::app {

/// A data file: in `data/` beside the program, or in `../share/meltstage/` of an installation. Throws
/// UserError that ends in `remedy` when it is in neither.
std::filesystem::path data_file(const std::string& name, const std::string& remedy);

/// The project's sources, which hold `part`: a folder above the program or above the working folder. Throws
/// UserError when there is none.
std::filesystem::path checkout_with(const std::filesystem::path& part);

}  // namespace meltstage::app
