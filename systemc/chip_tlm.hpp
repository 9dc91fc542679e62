// SPDX-License-Identifier: Apache-2.0
// The C++ model as a TLM-2.0 target: register access in zero time, the pins beside it. Use:
// docs/chip/systemc.md.
#pragma once

#include <tlm.h>
#include <tlm_utils/simple_target_socket.h>

#include "cmodel/host_access.hpp"
#include "systemc/chip_module.hpp"

namespace meltstage::systemc {

// Byte address = 2 x PDU address of docs/chip/registers.md; 16-bit words, low byte first, whatever the
// simulating machine. b_transport does what a valid Modbus frame does (chip::host_read, chip::host_write): up
// to 32 registers read, up to 16 written, all or none. It takes no time, leaves the delay alone, and may be
// called from threads and methods. transport_dbg only looks: any number of registers, no message counted, no
// watchdog reloaded; it writes nothing. No DMI.
//
// Response status: TLM_ADDRESS_ERROR_RESPONSE odd or outside the map (exception 02); TLM_BURST_ERROR_RESPONSE
// length 0, odd, above the limit, or a streaming width below the length; TLM_BYTE_ENABLE_ERROR_RESPONSE any
// byte enables; TLM_COMMAND_ERROR_RESPONSE neither read nor write; TLM_GENERIC_ERROR_RESPONSE refused by the
// chip: exception() says why.
class TcChipTlm : public sc_core::sc_module {
 public:
  tlm_utils::simple_target_socket<TcChipTlm> socket{"socket"};
  TcChip pins{"pins"};

  explicit TcChipTlm(const sc_core::sc_module_name& name);

  // The chip's answer to the last b_transport that reached it: Modbus exception code, spec::kExcNone when
  // carried out.
  chip::spec::Exception exception() const { return exception_; }

 private:
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay);
  unsigned transport_dbg(tlm::tlm_generic_payload& payload);
  chip::spec::Exception access(tlm::tlm_generic_payload& payload);

  chip::spec::Exception exception_ = chip::spec::kExcNone;
};

}  // namespace meltstage::systemc
