// SPDX-License-Identifier: Apache-2.0
// What reader and writer of .mvec share.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace meltstage::recording {

inline constexpr std::string_view kTextMagic = "meltstage-vectors";
inline constexpr unsigned kTextVersion = 1;
/// No line that the writer makes is longer: kMaxPins changes of kMaxNameBytes, ' ', '=', "0x" and 16 digits
/// each.
inline constexpr std::size_t kMaxLineBytes = std::size_t{2} * 1024 * 1024;

/// Bytes below 0x20, 0x7f and the backslash can't stand for themselves in origin and meta values.
constexpr bool needs_escape(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '\\'; }

/// "\\" for a backslash, "\xHH" (lower case) for the other bytes that need it.
std::string escape(std::string_view text);

}  // namespace meltstage::recording
