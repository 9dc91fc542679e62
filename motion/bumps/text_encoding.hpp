// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: text files of other programs in UTF-8.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace meltstage::motion::detail {

/// The text in UTF-8, or nothing if it is UTF-8 already. Read are UTF-16 with a byte order mark, and
/// Windows-1252 as long as its letters beyond ASCII stand alone among ASCII ones, as in "µm" and "Höhe":
/// bytes in a row may as well be Chinese, Japanese or Cyrillic letters, and these may name a side of the
/// board.
///
/// @throws CoordinateError with the line where the text is none of these.
std::optional<std::string> converted_to_utf8(const std::filesystem::path& path, std::string_view content);

}  // namespace meltstage::motion::detail
