// SPDX-License-Identifier: Apache-2.0
// What no file or folder to write is called.
#pragma once

#include <filesystem>

#include "base/error.hpp"

namespace meltstage {

/// Many programs write the standard output for the name "-". Here each call prints what it did there, so a
/// file of that name would be a surprise. Throws UserError.
inline void require_name_to_write(const std::filesystem::path& path) {
  if (path == "-")
    throw UserError(
        "-: found the sign for the standard output, expected the name of a file or folder to write; for one "
        "of this name say ./-");
}

}  // namespace meltstage
