// SPDX-License-Identifier: Apache-2.0
// Text that toml++ 3.3 may read.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace meltstage {

/// Text of a TOML file, fit for a parser that calls itself once for every bracket and every dot of a key.
/// Throws UserError as read_file() does, for a file of another kind, for brackets or keys that are nested too
/// deeply, and for characters beyond ASCII outside of strings and comments, which TOML 1.0 doesn't have.
std::string read_toml_text(const std::filesystem::path& path, std::string_view wanted);

}  // namespace meltstage
