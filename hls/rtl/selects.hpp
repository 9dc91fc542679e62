// SPDX-License-Identifier: Apache-2.0
// Choices by an index that Yosys 0.23 makes otherwise than IEEE 1800 (7.4.6, 11.5.1) for an index beyond:
//  - a bit of a packed struct's member: chosen from the whole struct;
//  - a slice that is written downwards, v[i -: 4]: left out where it ends below bit 0;
//  - a memory's word by a signed number of fewer bits than 32: taken without its sign.
#pragma once

#include <string>

namespace meltstage::hls {

/// Looks for them in what Yosys made of the RTL (RTLIL, flat and by modules) and in the files that it names.
/// Throws UserError that names the file, and the line where it is known.
void require_plain_selects(const std::string& rtl, const std::string& modules);

}  // namespace meltstage::hls
