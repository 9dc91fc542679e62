// SPDX-License-Identifier: Apache-2.0
// A file that a person gives, read whole.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace meltstage {

inline constexpr std::uint64_t kMostFileBytes = std::uint64_t{1} << 30;

/// The whole file. `wanted` ("a Liberty file") stands in messages. Throws UserError when it can't be read, is
/// a folder or holds more than `most_bytes`.
std::string read_file(const std::filesystem::path& path, std::string_view wanted,
                      std::uint64_t most_bytes = kMostFileBytes);

}  // namespace meltstage
