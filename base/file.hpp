// SPDX-License-Identifier: Apache-2.0
// The way in: every file that a person gives is read through read_file(), its numbers through number_in()
// (base/number.hpp), and what a message quotes of it through shown() (base/place.hpp). A reader bounds all
// that a file can make it repeat, keep or nest, and each refusal is one UserError with the place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace meltstage {

inline constexpr std::uint64_t kMostFileBytes = std::uint64_t{1} << 30;

/// Cells of one row of a table; a spreadsheet has as many.
inline constexpr std::size_t kMostColumns = 16384;

/// How deep brackets may stand in each other; a reader that calls itself goes no deeper.
inline constexpr std::size_t kMostNested = 64;

/// The whole file. `wanted` ("a Liberty file") stands in messages. Throws UserError when the file is missing,
/// is no regular file, can't be read or holds more than `most_bytes`.
std::string read_file(const std::filesystem::path& path, std::string_view wanted,
                      std::uint64_t most_bytes = kMostFileBytes);

/// What the first bytes look like, e.g. "a PNG image", for messages about files of the wrong kind; "text".
std::string_view describe_content(std::string_view content);

/// Throws UserError when the file to write is one of those that are read, by whatever name: relative,
/// symbolic link or hard link.
void require_other_file(const std::filesystem::path& output,
                        const std::vector<std::filesystem::path>& inputs);

/// The same for all files that one call writes, and when two of them are one. Empty paths aren't written.
void require_other_files(const std::vector<std::filesystem::path>& outputs,
                         const std::vector<std::filesystem::path>& inputs);

/// Throws UserError when one of the files that are read lies in the folder, which is going to be replaced.
void require_outside(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& inputs);

}  // namespace meltstage
