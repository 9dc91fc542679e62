// SPDX-License-Identifier: Apache-2.0
// A person's file with what happens to a virtual chip.
#pragma once

#include <filesystem>
#include <string>

namespace meltstage::app {

/// Its text, which tb::parse_scenario() takes. Throws UserError for a file that can't be read, and for one
/// with a line that isn't understood.
std::string scenario_text(const std::filesystem::path& path);

}  // namespace meltstage::app
