// SPDX-License-Identifier: Apache-2.0
// The RTL as a SystemC module, as Verilator makes it from rtl/, its test pins tied low. Ports as
// systemc::TcChip, names and types; link meltstage::rtl_sc. Its flops are undefined (zero) until the first
// clock or falling edge of rst_ni in reset.
#pragma once

#include <Vtc_top_sc.h>

#include "cmodel/spec.hpp"

namespace meltstage::systemc {

class TcRtl : public Vtc_top_sc {
 public:
  explicit TcRtl(const sc_core::sc_module_name& name) : Vtc_top_sc(name) {
    test_mode_i(test_mode_);
    scan_en_i(scan_en_);
    scan_i(scan_in_);
    scan_o(scan_out_);
  }

 private:
  sc_core::sc_signal<bool> test_mode_, scan_en_;
  sc_core::sc_signal<sc_dt::sc_uint<chip::spec::kScanChains>> scan_in_, scan_out_;
};

}  // namespace meltstage::systemc
