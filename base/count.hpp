// SPDX-License-Identifier: Apache-2.0
// Numbers of things in messages.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace meltstage {

/// "1 bump", "2 bumps"; for words that take an s.
inline std::string counted(std::size_t count, std::string_view thing) {
  return std::to_string(count) + " " + std::string(thing) + (count == 1 ? "" : "s");
}

}  // namespace meltstage
