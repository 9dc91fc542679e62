// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/coverage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "cmodel/algor.hpp"

namespace meltstage::tb {

namespace {

constexpr std::uint32_t kFullDuty = 1U << spec::kDutyFraction;

// A clock as the points see it.
struct Moment {
  const chip::Chip& now;
  const chip::Inputs& in;
  const chip::Outputs& out;
  const Coverage::Before& before;

  std::uint16_t param(spec::Reg reg) const { return now.params()[reg]; }
  bool heating() const { return now.guard.run_q != 0; }
  bool manual() const { return now.params().bit(spec::kRegMode, spec::kModeManual); }
  bool resets() const { return !in.rst_n && !before.reset; }
  std::uint8_t function() const { return now.uartc.cmd_fc(); }
  bool answered() const { return now.sysctrl.cmd_done_q != 0; }
  bool refused(unsigned exception) const {
    return answered() && now.paramc.rsp_kind_q == spec::kRspException && now.paramc.rsp_exc_q == exception;
  }
  bool identified(unsigned code) const {
    return answered() && function() == spec::kFcEncapsulated && (now.uartc.cmd_a() & 0xFF) == code &&
           (now.paramc.rsp_kind_q == spec::kRspIdStream || now.paramc.rsp_kind_q == spec::kRspIdObject);
  }
};

struct Point {
  const char* name;
  bool (*seen)(const Moment&);
};

constexpr Point kPoints[] = {
    {"heater pulse", [](const Moment& m) { return m.out.heater && !m.before.heater; }},
    {"heating by a manual duty",
     [](const Moment& m) { return m.heating() && m.manual() && m.now.algor.duty_q != 0; }},
    {"manual duty above DUTY_MAX",
     [](const Moment& m) {
       return m.heating() && m.manual() && m.now.algor.done_q != 0 &&
              m.now.algor.ext_q > m.now.algor.duty_max_q && m.now.algor.duty_max_q != 0;
     }},
    {"ramp up while heating",
     [](const Moment& m) {
       return m.heating() && m.param(spec::kRegRampUp) != 0 && m.now.algor.sp_work_q < m.now.algor.target_q;
     }},
    {"ramp down while heating",
     [](const Moment& m) {
       return m.heating() && m.param(spec::kRegRampDown) != 0 && m.now.algor.sp_work_q > m.now.algor.target_q;
     }},
    {"rise of the duty held by SLEW",
     [](const Moment& m) {
       return m.heating() && !m.manual() && m.now.algor.done_q != 0 && m.now.algor.slew_q != 0 &&
              m.now.algor.duty_q < static_cast<std::uint32_t>(m.now.algor.work_q);
     }},
    {"duty at a DUTY_MAX below 100 % in the PID segment",
     [](const Moment& m) {
       return m.now.algor.segment_q == spec::kSegPid && m.now.algor.limited() &&
              m.now.algor.duty_max_q < kFullDuty;
     }},
    {"integral above 0", [](const Moment& m) { return m.now.algor.i_q != 0; }},
    {"integral at its limit",
     [](const Moment& m) {
       return m.now.algor.i_q != 0 && m.now.algor.i_q == m.now.algor.duty_max_q << spec::kIntegFraction;
     }},
    {"integral held",
     [](const Moment& m) { return m.heating() && m.now.algor.i_q != 0 && m.now.algor.i_held_q != 0; }},
    {"whole degrees while heating",
     [](const Moment& m) {
       return m.heating() && m.now.algor.e_q != 0 &&
              m.now.params().bit(spec::kRegCtrl, spec::kCtrlErrInteger);
     }},
    {"droplets made up for",
     [](const Moment& m) {
       return m.heating() && m.now.algor.drops_q != 0 && m.param(spec::kRegFfDrop) != 0 &&
              m.now.algor.ext_q != 0;
     }},
    {"relay centred", [](const Moment& m) { return m.now.atune.cycles_q == spec::kTuneAdaptCycles; }},
    {"gains worked out", [](const Moment& m) { return m.now.atune.phase_q == chip::kTuneResults; }},
    {"tuning finished", [](const Moment& m) { return m.now.atune.end_q == chip::kTuneFinished; }},
    {"tuning stopped", [](const Moment& m) { return m.now.atune.end_q == chip::kTuneStopped; }},
    {"tuning ended by time", [](const Moment& m) { return m.now.atune.stop_q != 0; }},
    {"write refused while tuning",
     [](const Moment& m) { return m.refused(spec::kExcBusy) && m.now.atune.tuning(); }},
    {"error at temperature", [](const Moment& m) { return m.now.quality.error_q != 0; }},
    {"settling time",
     [](const Moment& m) { return m.now.quality.band_q != 0xFFFF && m.now.quality.band_q != 0; }},
    {"hold power counted",
     [](const Moment& m) { return m.now.guard.hold_q != 0 && m.now.guard.hold_test_q == 0; }},
    {"test of the reading", [](const Moment& m) { return m.now.guard.hold_test_q != 0; }},
    {"load shown by a fall of the reading",
     [](const Moment& m) { return m.now.guard.hold_shown_q != 0 && m.now.guard.hold_test_q == 0; }},
    {"loop break counted", [](const Moment& m) { return m.now.guard.lba_q != 0; }},
    {"at temperature", [](const Moment& m) { return m.out.at_temp; }},
    {"late tick", [](const Moment& m) { return m.now.sysctrl.overrun_q != 0; }},
    {"prescaler while heating", [](const Moment& m) { return m.out.heater && m.now.pwmc.prescale_q != 0; }},
    {"PWM period below 2", [](const Moment& m) { return m.param(spec::kRegPwmPeriod) < 2; }},
    {"test mode while heating",
     [](const Moment& m) { return m.in.test_mode && m.heating() && m.now.sysctrl.tenth_q != 0; }},
    {"reset in test mode", [](const Moment& m) { return m.resets() && m.in.test_mode; }},
    {"reset", [](const Moment& m) { return m.resets(); }},
    {"reset while heating", [](const Moment& m) { return m.resets() && m.before.heating; }},
    {"reset while answering", [](const Moment& m) { return m.resets() && m.before.answering; }},
    {"reset with telemetry due", [](const Moment& m) { return m.resets() && m.before.telemetry_due; }},
    {"reset after a refused sample", [](const Moment& m) { return m.resets() && m.before.sample_refused; }},
    {"STOP while heating", [](const Moment& m) { return m.heating() && m.now.paramc.stop_q != 0; }},
    {"STOP seen on the wire while heating",
     [](const Moment& m) { return m.heating() && m.now.uartc.stop(); }},
    {"refusal by LOCK",
     [](const Moment& m) { return m.refused(spec::kExcDevice) && m.param(spec::kRegLock) != 0; }},
    {"function code 08 with another sub-function",
     [](const Moment& m) { return m.refused(spec::kExcFunction) && m.function() == spec::kFcDiagnostics; }},
    {"function code 43 with another MEI type",
     [](const Moment& m) { return m.refused(spec::kExcFunction) && m.function() == spec::kFcEncapsulated; }},
    {"identification 01", [](const Moment& m) { return m.identified(1); }},
    {"identification 02", [](const Moment& m) { return m.identified(2); }},
    {"identification 03", [](const Moment& m) { return m.identified(3); }},
    {"identification 04", [](const Moment& m) { return m.identified(spec::kIdentificationObject); }},
    {"broadcast", [](const Moment& m) { return m.answered() && m.now.uartc.cmd_broadcast(); }},
    {"commit", [](const Moment& m) { return m.now.sysctrl.commit_q != 0; }},
    {"telemetry frame", [](const Moment& m) { return m.now.sysctrl.tlm_start_q != 0; }},
    {"character error", [](const Moment& m) { return m.now.uartc.char_errors() != 0; }},
    {"refused sample", [](const Moment& m) { return m.now.guard.sensor_errors_q != 0; }},
    {"corrected parameter flip", [](const Moment& m) { return m.now.mem.corrected() != 0; }},
};
static_assert(std::size(kPoints) <= Coverage::kMostPoints);

// Bytes of a frame of this function code; 0 = unknown.
unsigned right_length(const chip::Uartc& uart) {
  switch (static_cast<spec::Function>(uart.cmd_fc())) {
    case spec::kFcReadHolding:
    case spec::kFcReadInput:
    case spec::kFcWriteSingle:
    case spec::kFcDiagnostics:
      return 8;
    case spec::kFcWriteMultiple:
      return 9u + 2u * uart.cmd_b();
    case spec::kFcReportServerId:
      return 4;
    case spec::kFcEncapsulated:
      return 7;
  }
  return 0;
}

}  // namespace

void Coverage::observe(const chip::Chip& now, const chip::Inputs& in, const chip::Outputs& out) {
  const Moment moment{now, in, out, before_};
  for (std::size_t i = 0; i < std::size(kPoints); ++i) {
    if (!points[i]) points[i] = kPoints[i].seen(moment);
  }
  if (in.rst_n) {
    crosses.observe(toggles.last(), now);
    ends.observe(now);
  }
  toggles.observe(in, now);
  const std::uint8_t state = now.sysctrl.state_q & 31;
  if (in.rst_n) {
    ++states[state];
    if (state != before_.state) ++arcs[before_.state][state];
    if (const unsigned rising = now.guard.fault_q & ~unsigned{before_.fault}) {
      for (unsigned i = 0; i < spec::kFaultCount; ++i) latched[i] += rising >> i & 1;
    }
    if (moment.heating()) ++segments[now.algor.segment_q & 3];
    if (moment.answered()) {
      const std::uint8_t function = moment.function();
      ++functions[function];
      if (now.paramc.rsp_kind_q == spec::kRspException) ++exceptions[now.paramc.rsp_exc_q];
      if (moment.refused(spec::kExcValue) && now.uartc.cmd_len() != right_length(now.uartc))
        ++wrong_lengths[function];
    }
    const unsigned sensor = moment.param(spec::kRegSensType);
    if (now.sensc.done() && now.sensc.ok() && sensor < sensors.size()) ++sensors[sensor];
    crc_errors += now.uartc.crc_errors() != before_.crc_errors;
  }
  before_ = {.state = state,
             .fault = now.guard.fault_q,
             .crc_errors = now.uartc.crc_errors(),
             .reset = !in.rst_n,
             .heating = moment.heating(),
             .answering = out.uart_de,
             .telemetry_due = now.sysctrl.tlm_due_q != 0,
             .sample_refused = now.guard.bad_q != 0,
             .heater = out.heater};
}

void Coverage::add(const Coverage& other) {
  const auto sum = [](auto& a, const auto& b) {
    std::transform(a.begin(), a.end(), b.begin(), a.begin(), std::plus<>{});
  };
  sum(states, other.states);
  for (std::size_t i = 0; i < arcs.size(); ++i) sum(arcs[i], other.arcs[i]);
  sum(latched, other.latched);
  sum(segments, other.segments);
  sum(functions, other.functions);
  sum(wrong_lengths, other.wrong_lengths);
  sum(exceptions, other.exceptions);
  sum(sensors, other.sensors);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = points[i] || other.points[i];
  crc_errors += other.crc_errors;
  toggles.add(other.toggles);
  crosses.add(other.crosses);
  ends.add(other.ends);
}

std::vector<std::string> Coverage::holes() const {
  std::vector<std::string> list;
  const auto want = [&](bool seen, std::string what) {
    if (!seen) list.push_back(std::move(what));
  };
  for (const spec::StateInfo& s : spec::kStates) want(states[s.code] != 0, fmt::format("state {}", s.name));
  for (const spec::StateArc& a : spec::kStateArcs) {
    want(arcs[a.from][a.to] != 0,
         fmt::format("arc {} -> {}", spec::state_name(a.from), spec::state_name(a.to)));
  }
  for (unsigned i = 0; i < spec::kFaultCount; ++i)
    want(latched[i] != 0, fmt::format("fault {}", spec::kFaults[i].name));
  for (const unsigned fc : spec::kFunctions) {
    want(functions[fc] != 0, fmt::format("function code {}", fc));
    want(wrong_lengths[fc] != 0, fmt::format("wrong length with function code {}", fc));
  }
  for (const unsigned exc : spec::kExceptions)
    want(exceptions[exc] != 0, fmt::format("exception {:02}", exc));
  for (const unsigned segment : spec::kSegments) {
    want(segments[segment] != 0, fmt::format("segment {}", segment));
  }
  for (std::size_t i = 0; i < sensors.size(); ++i)
    want(sensors[i] != 0, fmt::format("sample of sensor {}", spec::kSensorPresets[i].name));
  for (std::size_t i = 0; i < std::size(kPoints); ++i) want(points[i], kPoints[i].name);
  want(crc_errors != 0, "CRC error");
  return list;
}

}  // namespace meltstage::tb
