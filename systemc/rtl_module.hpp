// SPDX-License-Identifier: Apache-2.0
// The RTL as a SystemC module, as Verilator makes it from rtl/. Ports as systemc::TcChip, names and types;
// link meltstage::rtl_sc. Its flops are undefined (zero) until the first clock or falling edge of rst_ni in
// reset.
#pragma once

#include <Vtc_top_sc.h>

namespace meltstage::systemc {

using TcRtl = Vtc_top_sc;

}  // namespace meltstage::systemc
