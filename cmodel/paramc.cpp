// SPDX-License-Identifier: Apache-2.0
#include "paramc.hpp"

namespace meltstage::chip {

namespace {

// Bits of STATUS that PARAMC itself knows.
constexpr unsigned kOwnStatus = 1u << spec::kStatusHold | 1u << spec::kStatusWritesPending;

struct Judgement {
  spec::Exception exception;
  spec::RspKind kind;
};

bool is_write(const Command& c) { return c.fc == spec::kFcWriteSingle || c.fc == spec::kFcWriteMultiple; }

bool in_holding(const Command& c) {
  const auto end = static_cast<std::uint16_t>(c.a + (c.fc == spec::kFcWriteSingle ? 1 : c.b));
  return c.a >= spec::kHoldingBase && end <= spec::kHoldingBase + spec::kHoldingCount && end > c.a;
}

bool in_input(const Command& c) {
  const auto end = static_cast<std::uint16_t>(c.a + (c.fc == spec::kFcWriteSingle ? 1 : c.b));
  return c.a < spec::kInputCount && end <= spec::kInputCount;
}

// Function, length, count, address, in the order the standard asks for.
Judgement judge_form(const Command& c) {
  switch (c.fc) {
    case spec::kFcReadHolding:
    case spec::kFcReadInput:
      if (c.len != 8 || c.b == 0 || c.b > spec::kMaxRead) return {spec::kExcValue, spec::kRspRead};
      return {in_holding(c) || in_input(c) ? spec::kExcNone : spec::kExcAddress, spec::kRspRead};
    case spec::kFcWriteSingle:
      if (c.len != 8) return {spec::kExcValue, spec::kRspEcho};
      return {in_holding(c) ? spec::kExcNone : spec::kExcAddress, spec::kRspEcho};
    case spec::kFcWriteMultiple:
      if (c.b == 0 || c.b > spec::kWriteWords || c.count != 2 * c.b || c.len != 9 + 2 * c.b)
        return {spec::kExcValue, spec::kRspEcho};
      return {in_holding(c) ? spec::kExcNone : spec::kExcAddress, spec::kRspEcho};
    case spec::kFcDiagnostics:
      if (c.a != 0) return {spec::kExcFunction, spec::kRspEcho};
      return {c.len == 8 ? spec::kExcNone : spec::kExcValue, spec::kRspEcho};
    case spec::kFcReportServerId:
      return {c.len == 4 ? spec::kExcNone : spec::kExcValue, spec::kRspServerId};
    case spec::kFcEncapsulated: {
      const unsigned code = c.a & 0xFFu;
      const spec::RspKind kind =
          code == spec::kIdentificationObject ? spec::kRspIdObject : spec::kRspIdStream;
      if ((c.a >> 8) != spec::kMeiType) return {spec::kExcFunction, kind};
      if (c.len != 7 || code == 0 || code > spec::kIdentificationObject) return {spec::kExcValue, kind};
      if (code == spec::kIdentificationObject && (c.b >> 8) >= spec::kIdentObjects.size())
        return {spec::kExcAddress, kind};
      return {spec::kExcNone, kind};
    }
    default:
      return {spec::kExcFunction, spec::kRspException};
  }
}

bool known_command(std::uint16_t word) {
  return word == spec::kCmdStop || word == spec::kCmdRun || word == spec::kCmdClearFault ||
         word == spec::kCmdHold || word == spec::kCmdCommit || word == spec::kCmdDiscard ||
         word == spec::kCmdTune;
}

// Raw value against min..max of its register; index beyond the map: no bounds, as in the RTL's default.
bool out_of_range(unsigned index, std::uint16_t raw) {
  if (index >= spec::kHoldingCount) return false;
  const spec::RegisterInfo& info = spec::kHolding[index];
  const std::int32_t value = info.is_signed ? static_cast<std::int16_t>(raw) : raw;
  return value < info.min || value > info.max;
}

// `ordered`: a commit is on its way; `held_back`: writes are staged, or the host has asked to keep them so.
spec::Exception judge_value(unsigned index, std::uint16_t raw, const ParamcIn& in, bool ordered,
                            bool held_back) {
  const bool is_cmd = index == spec::kRegCmd;
  if (is_cmd && !known_command(raw)) return spec::kExcValue;
  if (out_of_range(index, raw)) return spec::kExcValue;
  const auto limit = static_cast<std::int16_t>(in.t_max_staged - spec::kSetpointMargin);
  if (index == spec::kRegSetpoint && static_cast<std::int16_t>(raw) > limit) return spec::kExcValue;
  if (is_cmd && raw == spec::kCmdStop) return spec::kExcNone;
  if (in.lock != 0 && !(index == spec::kRegLock && raw == 0)) return spec::kExcDevice;
  const bool is_tune = is_cmd && raw == spec::kCmdTune;
  if (ordered || in.tuning || (is_tune && held_back)) return spec::kExcBusy;
  if (is_cmd && raw == spec::kCmdRun && !in.run_allowed) return spec::kExcDevice;
  if (is_cmd && raw == spec::kCmdClearFault && in.cause_present) return spec::kExcDevice;
  if (is_tune && (!in.running || in.manual)) return spec::kExcDevice;
  return spec::kExcNone;
}

// 1/64 degC to 0.1 degC, rounded.
std::uint16_t tenths(std::int16_t temp) { return static_cast<std::uint16_t>((temp * 5 + 16) >> 5); }
// 2^-16 to 0.01 %, rounded.
std::uint16_t percent(std::int32_t duty) { return static_cast<std::uint16_t>((duty * 625 + 2048) >> 12); }

}  // namespace

void Paramc::step(const ParamcIn& in, const Readings& r) {
  const Command& c = in.cmd;
  const unsigned reg_now = (c.a + word_q) & 0x3Fu;
  const std::uint16_t value_now = c.fc == spec::kFcWriteSingle ? c.b : in.cmd_word;
  const bool last_now = c.fc == spec::kFcWriteSingle || word_q + 1u == c.b;
  const bool exec = in.write && index_q == spec::kRegCmd;
  const std::uint8_t discard_past = discard_q;
  const std::uint8_t staged_past = staged_q;
  const bool held_back = (staged_q | hold_q) != 0;
  const bool ordered = ordered_q != 0;

  run_q = exec && value_q == spec::kCmdRun;
  stop_q = exec && value_q == spec::kCmdStop;
  clear_q = exec && value_q == spec::kCmdClearFault;
  discard_q = exec && value_q == spec::kCmdDiscard;
  tune_q = exec && value_q == spec::kCmdTune;
  if (exec && value_q == spec::kCmdCommit && staged_past != 0) {
    ordered_q = 1;
  } else if (in.commit || discard_past != 0) {
    ordered_q = 0;
  }
  if ((in.write && store()) || in.tune_wr) {
    staged_q = 1;
  } else if (in.commit || discard_past != 0) {
    staged_q = 0;
  }
  if (exec && value_q == spec::kCmdHold) {
    hold_q = 1;
  } else if (exec && (value_q == spec::kCmdCommit || value_q == spec::kCmdDiscard)) {
    hold_q = 0;
  }

  if (in.decode && decoded_q == 0) {
    if (checking_q == 0) {
      const Judgement form = judge_form(c);
      word_q = 0;
      if (form.exception == spec::kExcNone && is_write(c)) {
        checking_q = 1;
      } else {
        decoded_q = 1;
        writes_q = 0;
        rsp_kind_q = c.broadcast                        ? spec::kRspNone
                     : form.exception != spec::kExcNone ? spec::kRspException
                                                        : form.kind;
        rsp_exc_q = form.exception != spec::kExcNone                ? form.exception
                    : form.kind == spec::kRspServerId && in.running ? 0xFF
                                                                    : 0;
      }
    } else {
      const spec::Exception exception = judge_value(reg_now, value_now, in, ordered, held_back);
      if (exception != spec::kExcNone || last_now) {
        checking_q = 0;
        decoded_q = 1;
        writes_q = exception == spec::kExcNone;
        rsp_kind_q = c.broadcast                   ? spec::kRspNone
                     : exception != spec::kExcNone ? spec::kRspException
                                                   : spec::kRspEcho;
        rsp_exc_q = exception;
        word_q = 0;
      } else {
        word_q = (word_q + 1) & 0xF;
      }
    }
  } else if (!in.decode) {
    decoded_q = 0;
    checking_q = 0;
  }

  if (in.extract && !in.discarding) {
    index_q = static_cast<std::uint8_t>(reg_now);
    value_q = value_now;
    last_q = last_now;
    word_q = (word_q + 1) & 0xF;
  }

  if (in.display && !in.rd_busy) {
    snap_valid_q = r.pv_valid;
    snap_pv_q = r.pv;
    snap_slope_q = r.slope;
    snap_sp_q = r.sp_work;
    snap_samples_q = r.samples;
    snap_duty_q = r.duty;
    snap_p_q = r.term_p;
    snap_i_q = r.term_i;
    snap_d_q = r.term_d;
    snap_raw_q = r.raw;
  }
}

std::uint16_t Paramc::read(std::uint16_t address, const Readings& r, std::uint16_t mem) const {
  if ((address & spec::kHoldingBase) != 0) return mem;
  switch (address & 0x3F) {
    case spec::kInStatus:
      return static_cast<std::uint16_t>((r.status & ~kOwnStatus) | hold_q << spec::kStatusHold |
                                        staged_q << spec::kStatusWritesPending);
    case spec::kInPv:
      return snap_valid_q != 0 ? tenths(snap_pv_q) : spec::kPvNone;
    case spec::kInSpWork:
      return tenths(snap_sp_q);
    case spec::kInDuty:
      return percent(static_cast<std::int32_t>(snap_duty_q));
    case spec::kInFault:
      return r.fault;
    case spec::kInFirstFault:
      return static_cast<std::uint16_t>(r.first_fault << 8 | r.state);
    case spec::kInPvFine:
      return static_cast<std::uint16_t>(snap_pv_q);
    case spec::kInPvSlope:
      return static_cast<std::uint16_t>(snap_slope_q);
    case spec::kInTermP:
      return percent(snap_p_q);
    case spec::kInTermI:
      return percent(snap_i_q);
    case spec::kInTermD:
      return percent(snap_d_q);
    case spec::kInRawH:
      return static_cast<std::uint16_t>(snap_raw_q >> 16);
    case spec::kInRawL:
      return static_cast<std::uint16_t>(snap_raw_q);
    case spec::kInSamples:
      return snap_samples_q;
    case spec::kInWdLeft:
      return r.wd_left;
    case spec::kInCause:
      return r.cause;
    case spec::kInCrcErrors:
      return r.crc_errors;
    case spec::kInCharErrors:
      return r.char_errors;
    case spec::kInMessages:
      return r.messages;
    case spec::kInSensorErrors:
      return r.sensor_errors;
    case spec::kInMemCorrected:
      return r.mem_corrected;
    case spec::kInDeviceId:
      return spec::kDeviceId;
    case spec::kInVersion:
      return spec::kVersion;
    case spec::kInMapCrc:
      return spec::kMapCrc;
    case spec::kInOvershoot:
      return r.overshoot;
    case spec::kInBandTime:
      return r.band_time;
    case spec::kInBandError:
      return r.band_error;
    case spec::kInPeak:
      return r.peak;
    case spec::kInOnTimeH:
      return static_cast<std::uint16_t>(r.on_time >> 16);
    case spec::kInOnTimeL:
      return static_cast<std::uint16_t>(r.on_time);
    case spec::kInAtState:
      return r.tune_state;
    case spec::kInAtKu:
      return r.tune_ku;
    case spec::kInAtTu:
      return r.tune_tu;
    case spec::kInAtDuty:
      return percent(static_cast<std::int32_t>(r.tune_hold));
    default:
      return 0;
  }
}

}  // namespace meltstage::chip
