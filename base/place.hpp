// SPDX-License-Identifier: Apache-2.0
// Where in a text something stands, and how a message shows what stands there.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace meltstage {

/// Counted from 1; every byte is a column.
struct Place {
  std::size_t line = 1;
  std::size_t column = 1;
};

/// The place of the byte at `offset`; behind the last byte when `offset` is beyond it.
Place place_of(std::string_view text, std::size_t offset);

/// Text as a terminal may have it: control characters and bytes that are no UTF-8 as \xNN.
std::string escaped(std::string_view text);

/// A piece of a file for a message: escaped(), cut behind 80 bytes.
std::string shown(std::string_view text);

/// "FILE:LINE:COLUMN: found FOUND, expected EXPECTED".
std::string defect_at(std::string_view file, Place place, std::string_view found, std::string_view expected);

}  // namespace meltstage
