// SPDX-License-Identifier: Apache-2.0
#include "host_access.hpp"

#include <algorithm>

namespace meltstage::chip {

namespace {

constexpr std::uint16_t kReadFrameBytes = 8;
constexpr std::uint16_t kWriteFrameBytes = 9;  // without the values
constexpr std::size_t kMostCount = 127;        // what the byte count of a frame can say

constexpr std::uint16_t kCmdAddress = spec::kHoldingBase + spec::kRegCmd;

bool in_reset(const Chip& chip) { return !chip.rst_sync.rst_n(); }

// What every sound frame to the chip does, whatever the answer: PARAMC and SYSCTRL go through CmdDecode to
// CmdReady, or the frame waits there while a control tick is carried out.
void count_frame(Chip& chip) {
  ++chip.uartc.frame.messages_q;
  chip.uartc.frame.good_q = 1;
  const std::uint8_t state = chip.sysctrl.state_q;
  if (state == spec::kStIdle || state == spec::kStCfgPwm) chip.sysctrl.state_q = spec::kStCmdReady;
}

Command read_command(std::uint16_t address, std::size_t count) {
  return {.broadcast = false,
          .fc = spec::kFcReadHolding,
          .a = address,
          .b = static_cast<std::uint16_t>(std::min(count, kMostCount)),
          .count = 0,
          .len = kReadFrameBytes};
}

Command write_command(std::uint16_t address, std::size_t count) {
  const auto words = static_cast<std::uint16_t>(std::min(count, kMostCount));
  return {.broadcast = false,
          .fc = spec::kFcWriteMultiple,
          .a = address,
          .b = words,
          .count = static_cast<std::uint8_t>(2 * words),
          .len = static_cast<std::uint16_t>(kWriteFrameBytes + 2 * words)};
}

ParamcIn paramc_inputs(const Chip& chip, const Command& command) {
  return {.decode = false,
          .extract = false,
          .write = false,
          .commit = false,
          .display = false,
          .cmd = command,
          .cmd_word = 0,
          .discarding = false,
          .t_max_staged = chip.mem.t_max_staged(),
          .lock = chip.params()[spec::kRegLock],
          .running = chip.guard.run_q != 0,
          .manual = chip.params().bit(spec::kRegMode, spec::kModeManual),
          .tuning = chip.atune.tuning(),
          .tune_wr = false,
          .run_allowed = chip.guard.run_allowed(),
          .cause_present = chip.guard.cause_q != 0,
          .rd_busy = true};
}

// PARAMC at rest, with the staged set's bookkeeping: the flops of a serial command that waits or was just
// answered stay the chip's own.
Paramc at_rest(const Paramc& paramc) {
  Paramc rest;
  rest.staged_q = paramc.staged_q;
  rest.hold_q = paramc.hold_q;
  rest.ordered_q = paramc.ordered_q;
  return rest;
}

std::uint16_t word_or_zero(std::span<const std::uint16_t> values, unsigned index) {
  return index < values.size() ? values[index] : std::uint16_t{0};
}

// PARAMC's verdict as in state CmdDecode.
spec::Exception decode(Paramc& paramc, ParamcIn in, std::span<const std::uint16_t> values) {
  in.decode = true;
  while (paramc.decoded_q == 0) {
    in.cmd_word = word_or_zero(values, paramc.word_q);
    paramc.step(in, Readings{});
  }
  return paramc.rsp_kind_q == spec::kRspException ? static_cast<spec::Exception>(paramc.rsp_exc_q)
                                                  : spec::kExcNone;
}

// States ExtrParam and WrParam in turn, and the clock after them. Pulses to GUARD are left in `chip` for its
// next clock.
void carry_out(Chip& chip, Paramc& paramc, ParamcIn in, std::span<const std::uint16_t> values) {
  const auto clock = [&](bool extract, bool write) {
    in.extract = extract;
    in.write = write;
    in.cmd_word = word_or_zero(values, paramc.word_q);
    const MemIn mem_in{.wr = write && paramc.store(),
                       .wr_index = paramc.index_q,
                       .wr_data = paramc.value_q,
                       .discard = paramc.discard_q != 0};
    paramc.step(in, Readings{});
    if (mem_in.wr || mem_in.discard) chip.mem.step(mem_in);
    while (chip.mem.discarding()) chip.mem.step({});
    chip.paramc.run_q |= paramc.run_q;
    if ((paramc.run_q | paramc.tune_q) != 0) {  // these count only with their word
      chip.paramc.index_q = paramc.index_q;
      chip.paramc.value_q = paramc.value_q;
    }
    chip.paramc.stop_q |= paramc.stop_q;
    chip.paramc.clear_q |= paramc.clear_q;
    chip.paramc.tune_q |= paramc.tune_q;
  };
  for (std::size_t i = 0; i < values.size(); ++i) {
    clock(true, false);
    clock(false, true);
  }
  clock(false, false);
  chip.paramc.staged_q = paramc.staged_q;
  chip.paramc.hold_q = paramc.hold_q;
  chip.paramc.ordered_q = paramc.ordered_q;
}

bool in_work(const Chip& chip) {
  return chip.sysctrl.decode() || chip.sysctrl.extract() || chip.sysctrl.write() ||
         chip.sysctrl.commit_q != 0 || chip.paramc.discard_q != 0 || chip.mem.discarding() ||
         chip.paramc.tune_q != 0;
}

bool writes_command(std::uint16_t address, std::span<const std::uint16_t> values, std::uint16_t command) {
  return address == kCmdAddress && !values.empty() && values[0] == command;
}

}  // namespace

spec::Exception host_read(Chip& chip, std::uint16_t address, std::span<std::uint16_t> out) {
  if (in_reset(chip)) return spec::kExcDevice;
  Paramc paramc = at_rest(chip.paramc);
  const spec::Exception exception =
      decode(paramc, paramc_inputs(chip, read_command(address, out.size())), {});
  count_frame(chip);
  if (exception != spec::kExcNone) return exception;
  for (std::uint16_t& word : out) word = chip.read_register(address++);
  return spec::kExcNone;
}

spec::Exception host_write(Chip& chip, std::uint16_t address, std::span<const std::uint16_t> values) {
  if (in_reset(chip)) return spec::kExcDevice;
  if (writes_command(address, values, spec::kCmdStop) && values.size() == 1) {
    count_frame(chip);
    chip.paramc.stop_q = 1;
    return spec::kExcNone;
  }
  if (in_work(chip)) return spec::kExcBusy;
  if (writes_command(address, values, spec::kCmdRun) && (chip.paramc.stop_q | chip.paramc.clear_q) != 0)
    return spec::kExcBusy;

  Paramc paramc = at_rest(chip.paramc);
  const ParamcIn in = paramc_inputs(chip, write_command(address, values.size()));
  const spec::Exception exception = decode(paramc, in, values);
  count_frame(chip);
  if (exception == spec::kExcNone) carry_out(chip, paramc, in, values);
  return exception;
}

}  // namespace meltstage::chip
