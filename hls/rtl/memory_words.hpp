// SPDX-License-Identifier: Apache-2.0
// Words beyond a memory. Yosys drops the upper bits of an address; IEEE 1800 leaves such a word unknown when
// it is read (7.4.6), and undone when it is written.
#pragma once

#include <string>

namespace meltstage::hls {

/// The module of Verilog that with_bounds() uses.
extern const char* const kBoundsModule;

/// RTLIL of one module whose memories ($memrd, $memwr) are read and written within their words alone: beyond,
/// x is read and nothing is written.
std::string with_bounds(const std::string& rtlil);

}  // namespace meltstage::hls
