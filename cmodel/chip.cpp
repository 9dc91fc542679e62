// SPDX-License-Identifier: Apache-2.0
#include "chip.hpp"

namespace meltstage::chip {

namespace {

// Pins in the order of tc_top's synchroniser.
std::uint8_t asynchronous_pins(const Inputs& in) {
  return static_cast<std::uint8_t>(static_cast<unsigned>(in.uart_rx) | (in.addr_strap & 7u) << 1 |
                                   static_cast<unsigned>(in.spi_miso) << 4 |
                                   static_cast<unsigned>(in.heater_fb) << 5 |
                                   static_cast<unsigned>(in.inhibit) << 6);
}

}  // namespace

Outputs Chip::outputs(const Inputs& in) const {
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

Readings Chip::readings() const {
  const Params& p = params();
  const bool flags[16] = {guard.run_q != 0,
                          guard.at_temp_q != 0,
                          algor.segment_q == kSegFull,
                          algor.segment_q == kSegPid,
                          algor.segment_q == kSegOff,
                          algor.ramping(),
                          algor.limited(),
                          false,  // writes pending and hold are PARAMC's own
                          false,
                          p[spec::kRegLock] != 0,
                          guard.sensor_ok(p),
                          algor.i_held_q != 0,
                          guard.wd_armed(p),
                          guard.bad_q != 0,
                          guard.permitted(),
                          guard.fault_q != 0};
  unsigned status = 0;
  for (unsigned i = 0; i < 16; ++i) status |= static_cast<unsigned>(flags[i]) << i;
  return {.pv_valid = guard.pv_valid_q != 0,
          .pv = guard.pv_q,
          .slope = guard.slope_q,
          .sp_work = algor.sp_work_q,
          .duty = algor.duty_q,
          .term_p = algor.term_p(),
          .term_i = algor.term_i(),
          .term_d = algor.term_d(),
          .raw = sensc.raw(),
          .samples = guard.samples_q,
          .status = static_cast<std::uint16_t>(status),
          .fault = guard.fault_q,
          .cause = guard.cause_q,
          .first_fault = guard.first_q,
          .state = sysctrl.state_q,
          .wd_left = guard.wd_left(p),
          .crc_errors = uartc.crc_errors(),
          .char_errors = uartc.char_errors(),
          .messages = uartc.messages(),
          .sensor_errors = guard.sensor_errors_q,
          .mem_corrected = mem.corrected()};
}

std::uint16_t Chip::read_register(std::uint16_t address) const {
  return paramc.read(address, readings(), mem.rd_data(address & 0x3Fu));
}

// Every block's inputs are gathered from the flops of the clock before; only then the blocks move. MEM is
// last, because the others look at its parameters by reference.
void Chip::clock(const Inputs& in) {
  const Params& p = params();
  const std::uint8_t pins = sync.q();
  const bool inhibit = (pins >> 6 & 1) != 0;

  const UartcIn uartc_in{.rx = static_cast<std::uint8_t>(pins & 1),
                         .cfg_address = static_cast<std::uint8_t>(p[spec::kRegAddress]),
                         .strap = static_cast<std::uint8_t>(pins >> 1 & 7),
                         .cfg_baud = static_cast<std::uint16_t>(p[spec::kRegBaud] & 0x1FFF),
                         .cfg_format = static_cast<std::uint8_t>(p[spec::kRegFormat] & 3),
                         .cmd_done = sysctrl.cmd_done_q != 0,
                         .rsp_kind = paramc.rsp_kind_q,
                         .rsp_exc = paramc.rsp_exc_q,
                         .rd_data = uartc.reads() ? read_register(uartc.rd_addr()) : std::uint16_t{0},
                         .tlm_start = sysctrl.tlm_start_q != 0};
  const SysctrlIn sysctrl_in{.ts = p[spec::kRegTs],
                             .tlm_period = p[spec::kRegTlmPeriod],
                             .cmd_valid = uartc.cmd_valid(),
                             .decoded = paramc.decoded_q != 0,
                             .writes = paramc.writes_q != 0,
                             .last = paramc.last_q != 0,
                             .pending = paramc.pending(),
                             .sens_done = sensc.done(),
                             .algor_done = algor.done_q != 0};
  const ParamcIn paramc_in{.decode = sysctrl.decode(),
                           .extract = sysctrl.extract(),
                           .write = sysctrl.write(),
                           .commit = sysctrl.commit_q != 0,
                           .display = sysctrl.display(),
                           .cmd = {.broadcast = uartc.cmd_broadcast(),
                                   .fc = uartc.cmd_fc(),
                                   .a = uartc.cmd_a(),
                                   .b = uartc.cmd_b(),
                                   .count = uartc.cmd_count(),
                                   .len = uartc.cmd_len()},
                           .cmd_word = uartc.cmd_word(paramc.word_q),
                           .t_max_staged = mem.t_max_staged(),
                           .lock = p[spec::kRegLock],
                           .running = guard.run_q != 0,
                           .run_allowed = guard.run_allowed(),
                           .cause_present = guard.cause_q != 0,
                           .rd_busy = uartc.rsp_busy() || uartc.tlm_busy()};
  const MemIn mem_in{.wr = sysctrl.write() && paramc.store(),
                     .wr_index = paramc.index_q,
                     .wr_data = paramc.value_q,
                     .commit = sysctrl.commit_q != 0,
                     .discard = paramc.discard_q != 0,
                     .scrub_start = sysctrl.tick_q != 0};
  const SenscIn sensc_in{.params = p,
                         .start = sysctrl.sens_start_q != 0,
                         .reconfig = sysctrl.commit_q != 0,
                         .miso = (pins >> 4 & 1) != 0};
  const AlgorIn algor_in{.params = p,
                         .start = sysctrl.algor_start_q != 0,
                         .sample_ok = sensc.ok(),
                         .run = guard.run_q != 0,
                         .at_temp = guard.at_temp_q != 0,
                         .ms = sysctrl.ms_q != 0,
                         .pv = guard.pv_q};
  const PwmcIn pwmc_in{.prescale = p[spec::kRegPwmPrescale],
                       .period = p[spec::kRegPwmPeriod],
                       .min_on = p[spec::kRegPwmMinOn],
                       .dither = p.bit(spec::kRegCtrl, 4),
                       .enable = guard.run_q != 0,
                       .duty = algor.duty_q,
                       .load = sysctrl.pwm_load_q != 0};
  const GuardIn guard_in{.params = p,
                         .tenth = sysctrl.tenth_q != 0,
                         .sens_done = sensc.done(),
                         .sens_ok = sensc.ok(),
                         .sens_dev_fault = sensc.dev_fault(),
                         .sens_pv = sensc.pv(),
                         .duty = algor.duty_q,
                         .hold_limit = algor.hold_q,
                         .limited = algor.limited(),
                         .segment = algor.segment_q,
                         .sp_work = algor.sp_work_q,
                         .ramping = algor.ramping(),
                         .pwm = pwmc.pwm(),
                         .run = paramc.run_q != 0,
                         .stop = paramc.stop_q != 0 || uartc.stop(),
                         .clear = paramc.clear_q != 0,
                         .good_frame = uartc.good(),
                         .mem_bad = mem.bad(),
                         .state_illegal = sysctrl.illegal(),
                         .overrun = sysctrl.overrun_q != 0,
                         .inhibit = inhibit,
                         .heater_fb = (pins >> 5 & 1) != 0};

  if (!paramc.idle(paramc_in)) paramc.step(paramc_in, paramc_in.display ? readings() : Readings{});
  uartc.step(uartc_in);
  sysctrl.step(sysctrl_in);
  sensc.step(sensc_in);
  algor.step(algor_in);
  pwmc.step(pwmc_in);
  guard.step(guard_in);
  mem.step(mem_in);
  sync.step(asynchronous_pins(in));
}

Outputs Chip::step(const Inputs& in) {
  if (!in.rst_n) {
    *this = Chip{};
  } else {
    if (rst_sync.rst_n()) clock(in);
    rst_sync.step();
  }
  return outputs(in);
}

}  // namespace meltstage::chip
