// SPDX-License-Identifier: Apache-2.0
// Files that commands write.
#pragma once

#include <filesystem>
#include <string>

namespace meltstage::app {

/// Writes text to path; the file appears whole or not at all. Throws InputError when it can't be written.
void write_whole(const std::filesystem::path& path, const std::string& text);

}  // namespace meltstage::app
