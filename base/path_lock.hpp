// SPDX-License-Identifier: Apache-2.0
// Inside the base room: locks that tell what is in use from what a killed process has left.
#pragma once

#include <filesystem>

namespace meltstage::detail {

/// Locks a file, or with O_DIRECTORY as `kind` a folder; the lock ends with the process that holds it,
/// however that ends, or when what is returned is closed. -1 when another holds it, or when it is no `kind`.
int lock_of(const std::filesystem::path& path, int kind);

}  // namespace meltstage::detail
