// SPDX-License-Identifier: Apache-2.0
// What flops, pins and modules may be called.
#pragma once

#include <string>

namespace meltstage::hls {

/// An identifier as SystemVerilog takes it without a backslash: none of its own words.
bool is_identifier(const std::string& name);

/// At least an escaped identifier: printable, without spaces.
bool can_be_escaped(const std::string& name);

}  // namespace meltstage::hls
