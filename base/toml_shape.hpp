// SPDX-License-Identifier: Apache-2.0
// What a text must keep to before toml++ 3.3 may read it.
#pragma once

#include <string_view>

namespace meltstage {

/// Throws UserError, with the place in `file`, for brackets or keys that are nested too deeply: the parser
/// calls itself for each. Also for characters beyond ASCII outside of strings and comments, which TOML 1.0
/// doesn't have.
void check_toml_shape(std::string_view text, std::string_view file);

}  // namespace meltstage
