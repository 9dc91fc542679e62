// SPDX-License-Identifier: Apache-2.0
#include "chip.hpp"

#include <algorithm>

namespace meltstage::chip {

namespace {

// All asynchronous pins but feedback, which GUARD follows by itself, and miso, which SENSC takes at the end
// of a half period only.
constexpr std::uint8_t kPinsThatStir = 0xFFu & ~(1u << spec::kSyncHeaterFb | 1u << spec::kSyncSpiMiso);

}  // namespace

Readings Chip::readings() const {
  const Params& p = params();
  const auto flag = [](spec::StatusBit bit, bool present) { return static_cast<unsigned>(present) << bit; };
  // Writes pending and hold are PARAMC's own.
  const unsigned status =
      flag(spec::kStatusRun, guard.run_q != 0) | flag(spec::kStatusAtTemperature, guard.at_temp_q != 0) |
      flag(spec::kStatusFullSegment, algor.segment_q == spec::kSegFull) |
      flag(spec::kStatusPidSegment, algor.segment_q == spec::kSegPid) |
      flag(spec::kStatusOffSegment, algor.segment_q == spec::kSegOff) |
      flag(spec::kStatusRampActive, algor.ramping()) | flag(spec::kStatusDutyNearItsLimit, algor.limited()) |
      flag(spec::kStatusLocked, p[spec::kRegLock] != 0) | flag(spec::kStatusSensorOk, guard.sensor_ok(p)) |
      flag(spec::kStatusIntegralHeld, algor.i_held_q != 0) |
      flag(spec::kStatusWatchdogArmed, guard.wd_armed(p)) | flag(spec::kStatusSampleHeld, guard.bad_q != 0) |
      flag(spec::kStatusSafeEnActive, guard.permitted()) | flag(spec::kStatusFault, guard.fault_q != 0);
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
          .mem_corrected = mem.corrected(),
          .overshoot = quality.over_q,
          .band_time = quality.band_q,
          .band_error = quality.error_q,
          .peak = static_cast<std::uint16_t>(quality.peak_q),
          .on_time = quality.on_q,
          .tune_state = atune.state(),
          .tune_ku = atune.ku_q,
          .tune_tu = atune.tu(),
          .tune_hold = atune.hold_q};
}

std::uint16_t Chip::read_register(std::uint16_t address) const {
  return paramc.read(address, readings(), mem.rd_data(address & 0x3Fu));
}

UartcIn Chip::uartc_in() const {
  const Params& p = params();
  return {.rx = static_cast<std::uint8_t>(sync.q() >> spec::kSyncUartRx & 1),
          .cfg_address = static_cast<std::uint8_t>(p[spec::kRegAddress]),
          .strap = static_cast<std::uint8_t>(sync.q() >> spec::kSyncAddrStrap & 7),
          .cfg_baud = static_cast<std::uint16_t>(p[spec::kRegBaud] & 0x1FFF),
          .cfg_format = static_cast<std::uint8_t>(p[spec::kRegFormat] & spec::kFormatCharacterMask),
          .cfg_pause = p.bit(spec::kRegFormat, spec::kFormatPause),
          .cmd_done = sysctrl.cmd_done_q != 0,
          .rsp_kind = paramc.rsp_kind_q,
          .rsp_exc = paramc.rsp_exc_q,
          .rd_data = 0,
          .rd_wait = writes_staged() || sysctrl.commit_q != 0,
          .tlm_start = sysctrl.tlm_start_q != 0};
}

SysctrlIn Chip::sysctrl_in(const Inputs& in) const {
  const Params& p = params();
  return {.test_mode = in.test_mode,
          .ts = p[spec::kRegTs],
          .tlm_period = p[spec::kRegTlmPeriod],
          .cmd_valid = uartc.cmd_valid(),
          .decoded = paramc.decoded_q != 0,
          .writes = paramc.writes_q != 0,
          .last = paramc.last_q != 0,
          .pending = paramc.pending(),
          .discarding = discarding(),
          .sens_done = sensc.done(),
          .algor_done = algor.done_q != 0};
}

ParamcIn Chip::paramc_in() const {
  const Params& p = params();
  return {.decode = sysctrl.decode(),
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
          .discarding = discarding(),
          .t_max_staged = mem.t_max_staged(),
          .lock = p[spec::kRegLock],
          .running = guard.run_q != 0,
          .manual = p.bit(spec::kRegMode, spec::kModeManual),
          .tuning = atune.tuning(),
          .tune_wr = atune.wr(),
          .run_allowed = guard.run_allowed(),
          .cause_present = guard.cause_q != 0,
          .rd_busy = uartc.rsp_busy() || uartc.tlm_busy()};
}

MemIn Chip::mem_in() const {
  return {.wr = writes_staged(),
          .wr_index = atune.wr() ? atune.wr_index_q : paramc.index_q,
          .wr_data = atune.wr() ? atune.wr_data_q : paramc.value_q,
          .commit = sysctrl.commit_q != 0,
          .discard = paramc.discard_q != 0,
          .rd = uartc.rd_rsp_q != 0,
          .rd_index = static_cast<std::uint8_t>(uartc.rd_addr() & 0x3Fu),
          .scrub_start = sysctrl.tick_q != 0};
}

SenscIn Chip::sensc_in() const {
  return {.params = params(),
          .start = sysctrl.sens_start_q != 0,
          .reconfig = sysctrl.commit_q != 0,
          .miso = (sync.q() >> spec::kSyncSpiMiso & 1) != 0};
}

AlgorIn Chip::algor_in() const {
  return {.params = params(),
          .start = sysctrl.algor_start_q != 0,
          .sample_ok = guard.bad_q == 0,
          .run = guard.run_q != 0,
          .at_temp = guard.at_temp_q != 0,
          .ms = sysctrl.ms_q != 0,
          .pv = guard.pv_q,
          .drop = (sync.q() >> spec::kSyncDrop & 1) != 0,
          .hold_test = guard.hold_test_q != 0,
          .tuning = atune.tuning(),
          .tune_duty = atune.duty(),
          .tune_hold = atune.hold_q};
}

AtuneIn Chip::atune_in() const {
  return {.tune = paramc.tune(),
          .run = guard.run_q != 0,
          .sample = sysctrl.algor_start_q != 0 && guard.bad_q == 0,
          .tenth = sysctrl.tenth_q != 0,
          .commit = sysctrl.commit_q != 0,
          .pv = guard.pv_q,
          .sp_work = algor.sp_work_q,
          .amb = algor.amb_q,
          .ramping = algor.ramping(),
          .duty_max = algor.duty_max_q,
          .window = params()[spec::kRegAtWindow]};
}

QualityIn Chip::quality_in() const {
  return {.run = guard.run_q != 0,
          .sample = sysctrl.algor_start_q != 0 && guard.bad_q == 0,
          .tenth = sysctrl.tenth_q != 0,
          .pv = guard.pv_q,
          .target = algor.target_q,
          .window = params()[spec::kRegAtWindow],
          .at_temp = guard.at_temp_q != 0,
          .heater = guard.heater_q != 0};
}

PwmcIn Chip::pwmc_in() const {
  const Params& p = params();
  return {.prescale = p[spec::kRegPwmPrescale],
          .period = p[spec::kRegPwmPeriod],
          .min_on = p[spec::kRegPwmMinOn],
          .dither = p.bit(spec::kRegCtrl, spec::kCtrlDither),
          .enable = guard.run_q != 0,
          .duty = algor.duty_q,
          .load = sysctrl.pwm_load_q != 0};
}

GuardIn Chip::guard_in() const {
  return {.params = params(),
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
          .run = paramc.run(),
          .stop = paramc.stop_q != 0 || uartc.stop() || atune.stop_q != 0,
          .clear = paramc.clear_q != 0,
          .good_frame = uartc.good(),
          .mem_bad = mem.bad(),
          .state_illegal = sysctrl.illegal() || (guard.run_q != 0 && sysctrl.state_q == spec::kStIdle),
          .overrun = sysctrl.overrun_q != 0,
          .watch_parity = static_cast<std::uint8_t>(static_cast<unsigned>(pwmc.parity()) << 1 |
                                                    static_cast<unsigned>(algor.parity() != atune.parity())),
          .watch_still = static_cast<std::uint8_t>(
              static_cast<unsigned>(pwmc.still(pwmc_in())) << 1 |
              static_cast<unsigned>(algor.still(algor_in()) && atune.still(atune_in()))),
          .inhibit = (sync.q() >> spec::kSyncInhibit & 1) != 0,
          .heater_fb = (sync.q() >> spec::kSyncHeaterFb & 1) != 0};
}

// Every block's inputs are gathered from the flops of the clock before; only then the blocks move. MEM is
// last, because the others look at its parameters by reference.
void Chip::clock(const Inputs& in) {
  UartcIn to_uartc = uartc_in();
  const SysctrlIn to_sysctrl = sysctrl_in(in);
  const ParamcIn to_paramc = paramc_in();
  const MemIn to_mem = mem_in();
  const MemRow row = mem.in_hand(to_mem);
  if (uartc.reads()) to_uartc.rd_data = paramc.read(uartc.rd_addr(), readings(), row.data());
  const SenscIn to_sensc = sensc_in();
  const AlgorIn to_algor = algor_in();
  const AtuneIn to_atune = atune_in();
  const QualityIn to_quality = quality_in();
  const PwmcIn to_pwmc = pwmc_in();
  const GuardIn to_guard = guard_in();

  if (!paramc.idle(to_paramc)) paramc.step(to_paramc, to_paramc.display ? readings() : Readings{});
  uartc.step(to_uartc);
  sysctrl.step(to_sysctrl);
  sensc.step(to_sensc);
  algor.step(to_algor);
  atune.step(to_atune);
  quality.step(to_quality);
  pwmc.step(to_pwmc);
  guard.step(to_guard);
  mem.step(to_mem, row);
  sync.step(asynchronous_pins(in));
}

// The cheapest and the likeliest to move come first.
std::uint64_t Chip::quiet(const Inputs& in) const {
  // In reset nothing moves; this flop tells whether the last clock was one of reset.
  if (!in.rst_n) return rst_sync.stage_q == 0 ? kForever : 0;
  if (!rst_sync.rst_n()) return 0;
  const std::uint8_t pins = asynchronous_pins(in);
  std::uint64_t clocks = sync.quiet(pins, kPinsThatStir);
  const auto at_most = [&](std::uint64_t n) {
    clocks = std::min(clocks, n);
    return n != 0;
  };
  const SysctrlIn to_sysctrl = sysctrl_in(in);
  if (!at_most(pwmc.quiet(pwmc_in())) || !at_most(sysctrl.quiet(to_sysctrl)) ||
      !at_most(sensc.quiet(sensc_in())) || !at_most(mem.quiet(mem_in())) ||
      !at_most(uartc.quiet(uartc_in()))) {
    return 0;
  }
  const AlgorIn to_algor = algor_in();
  if (!at_most(algor.quiet(to_algor)) ||
      (algor.ramps(to_algor) && !at_most(sysctrl.clocks_to_ms(to_sysctrl))))
    return 0;
  if (!at_most(atune.quiet(atune_in())) || !at_most(quality.quiet(quality_in()))) return 0;
  if (!paramc.idle(paramc_in()) || !at_most(guard.quiet(guard_in(), sync.seen(pins, spec::kSyncHeaterFb))))
    return 0;
  return clocks;
}

void Chip::skip(const Inputs& in, std::uint64_t clocks) {
  if (clocks == 0) return;
  if (!in.rst_n) {
    *this = Chip{};
    return;
  }
  uartc.skip(uartc_in(), clocks);
  sysctrl.skip(sysctrl_in(in), clocks);
  sensc.skip(clocks);
  pwmc.skip(clocks);
  quality.skip(quality_in(), clocks);
  const std::uint8_t pins = asynchronous_pins(in);
  guard.skip(guard_in(), sync.seen(pins, spec::kSyncHeaterFb), clocks);
  sync.skip(pins, clocks);
}

Outputs Chip::step(const Inputs& in) {
  if (!in.rst_n) {
    *this = Chip{};
  } else {
    if (out_of_reset(in)) {
      clock(in);
    } else {
      const RstSync past = rst_sync;
      *this = Chip{};
      rst_sync = past;
    }
    rst_sync.step();
  }
  return outputs(in);
}

}  // namespace meltstage::chip
