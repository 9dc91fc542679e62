// SPDX-License-Identifier: Apache-2.0
// The whole chip, bit-accurate at every clock. Twin of rtl/tc_top.sv; use and contract: docs/chip/cmodel.md.
#pragma once

#include <cstdint>
#include <type_traits>

#include "algor.hpp"
#include "atune.hpp"
#include "guard.hpp"
#include "mem.hpp"
#include "paramc.hpp"
#include "pins.hpp"
#include "pwmc.hpp"
#include "quality.hpp"
#include "sensc.hpp"
#include "sync.hpp"
#include "sysctrl.hpp"
#include "uartc.hpp"

namespace meltstage::chip {

// A value: copying it saves the whole state, assigning the copy restores it. A fresh Chip is a chip in reset.
struct Chip {
  RstSync rst_sync;
  Sync sync;
  Uartc uartc;
  Sysctrl sysctrl;
  Paramc paramc;
  Mem mem;
  Sensc sensc;
  Algor algor;
  Atune atune;
  Quality quality;
  Pwmc pwmc;
  Guard guard;

  // One rising clock edge with the pins at `in` before it; the pins after it, with `in` still applied.
  Outputs step(const Inputs& in);
  // Coming clocks, at least, in which step(in) would do nothing but count, and move no output pin but
  // safe_en: for those, a skip does what that many steps do. kForever: for all. advance.hpp is the loop that
  // uses them.
  std::uint64_t quiet(const Inputs& in) const;
  // clocks <= quiet(in).
  void skip(const Inputs& in, std::uint64_t clocks);
  // The output pins now; only heater depends on an input (inhibit).
  Outputs outputs(const Inputs& in) const;

  // rst_ni past the reset synchroniser; straight in test mode.
  bool out_of_reset(const Inputs& in) const { return in.rst_n && (rst_sync.rst_n() || in.test_mode); }

  const Params& params() const { return mem.params(); }
  // Value of a register as a host would read it now. Addresses: docs/chip/registers.md.
  std::uint16_t read_register(std::uint16_t address) const;
  Readings readings() const;

 private:
  UartcIn uartc_in() const;  // all but rd_data
  SysctrlIn sysctrl_in(const Inputs& in) const;
  ParamcIn paramc_in() const;
  MemIn mem_in() const;
  SenscIn sensc_in() const;
  AlgorIn algor_in() const;
  AtuneIn atune_in() const;
  QualityIn quality_in() const;
  PwmcIn pwmc_in() const;
  GuardIn guard_in() const;
  void clock(const Inputs& in);
  // A word goes to MEM's staged set.
  bool writes_staged() const { return (sysctrl.write() && paramc.store()) || atune.wr(); }
  bool discarding() const { return paramc.discard_q != 0 || mem.discarding(); }
};

static_assert(std::is_trivially_copyable_v<Chip>);

inline Outputs Chip::outputs(const Inputs& in) const {
  return {.uart_tx = uartc.tx_o(),
          .uart_de = uartc.de(),
          .tlm_tx = uartc.tlm_tx(),
          .spi_sclk = sensc.sclk(),
          .spi_cs_n = sensc.cs_n(),
          .spi_mosi = sensc.mosi(),
          .heater = guard.heater_q != 0 && !in.inhibit,
          .safe_en = guard.safe_en_q != 0,
          .fault_n = guard.fault_q == 0,
          .at_temp = guard.at_temp_q != 0};
}

}  // namespace meltstage::chip
