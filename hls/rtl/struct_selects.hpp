// SPDX-License-Identifier: Apache-2.0
// Bits of a packed struct's member that are chosen by an index. Yosys 0.23 chooses from the whole struct, so
// that an index beyond the member is a bit of its neighbour, where IEEE 1800 has an unknown one (7.4.6).
#pragma once

#include <string>

namespace meltstage::hls {

/// Looks for them in what Yosys made of the RTL (RTLIL) and in the files that it names. Throws UserError that
/// names the file.
void require_no_struct_selects(const std::string& rtl);

}  // namespace meltstage::hls
