// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/random_requests.hpp"

#include <algorithm>
#include <array>

namespace meltstage::tb {

namespace {

std::uint16_t any16(Rng& rng) { return static_cast<std::uint16_t>(rng.bits()); }
std::uint16_t below16(Rng& rng, std::uint64_t bound) { return static_cast<std::uint16_t>(rng.below(bound)); }

std::uint16_t chosen(Rng& rng, const Choice& choice) {
  return choice.values[rng.below(choice.values.size())];
}

constexpr std::array kCommands{spec::kCmdRun,        spec::kCmdRun,        spec::kCmdRun,  spec::kCmdStop,
                               spec::kCmdClearFault, spec::kCmdClearFault, spec::kCmdHold, spec::kCmdCommit,
                               spec::kCmdDiscard,    spec::kCmdTune};

// The frame without its CRC.
std::vector<std::uint8_t> body(const ModbusRequest& request) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 2 < request.frame.size(); ++i) bytes.push_back(request.frame[i].data);
  return bytes;
}

ModbusRequest write_random_block(Rng& rng, std::uint8_t to) {
  if (one_in(rng, 8))  // outside the map
    return write_multiple_registers(to, any16(rng),
                                    std::vector<std::uint16_t>(1 + rng.below(16), any16(rng)));
  const unsigned first = 1 + static_cast<unsigned>(rng.below(spec::kRegTs - 1));
  std::vector<std::uint16_t> values;
  const unsigned count = 1 + static_cast<unsigned>(rng.below(std::min(16u, spec::kRegTs - first)));
  for (unsigned i = 0; i < count; ++i) values.push_back(any_value(rng, first + i));
  return write_multiple_registers(to, holding_address(first), values);
}

ModbusRequest write_random_register(Rng& rng, std::uint8_t to) {
  unsigned index;
  do index = static_cast<unsigned>(rng.below(spec::kHoldingCount));
  while (!writable(index));
  return write_single_register(to, holding_address(index), any_value(rng, index));
}

ModbusRequest unknown_function(Rng& rng, std::uint8_t to) {
  std::vector<std::uint8_t> bytes{to, static_cast<std::uint8_t>(rng.below(128))};
  if (one_in(rng, 4)) bytes.push_back(0x0E);  // the MEI type that belongs to 2B alone
  for (std::uint64_t n = rng.below(9); n > 0; --n) bytes.push_back(static_cast<std::uint8_t>(rng.bits()));
  return with_crc(bytes);
}

}  // namespace

Settings draw(Rng& rng, const Choices& choices) {
  Settings settings;
  for (const Choice& choice : choices) settings.push_back({choice.reg, chosen(rng, choice)});
  return settings;
}

ModbusRequest draw(Rng& rng, const Mix& mix, std::uint8_t unit, const Choices& choices) {
  std::uint64_t total = 0;
  for (const Share& share : mix) total += share.weight;
  std::uint64_t at = rng.below(total);
  for (const Share& share : mix) {
    if (at < share.weight) return share.make(rng, unit, choices);
    at -= share.weight;
  }
  return mix.back().make(rng, unit, choices);
}

std::uint16_t any_value(Rng& rng, unsigned index) {
  const spec::RegisterInfo& info = spec::kHolding[index];
  switch (rng.below(8)) {
    case 0:
      return static_cast<std::uint16_t>(info.min);
    case 1:
      return static_cast<std::uint16_t>(info.max);
    case 2:
      return any16(rng);
    case 3:
      return static_cast<std::uint16_t>(info.min - 1);
    case 4:
      return static_cast<std::uint16_t>(info.max + 1);
    default: {
      const auto span = static_cast<std::uint64_t>(info.max - info.min) + 1;
      return static_cast<std::uint16_t>(info.min + static_cast<std::int64_t>(rng.below(span)));
    }
  }
}

bool writable(unsigned index) {
  return index != spec::kRegBaud && index != spec::kRegTs && index != spec::kRegSpiDiv;
}

ModbusRequest order_by_block(Rng& rng, std::uint8_t unit, const Choices&) {
  std::vector<std::uint16_t> values{one_in(rng, 2) ? spec::kCmdStop : kCommands[rng.below(kCommands.size())]};
  if (one_in(rng, 3)) values.push_back(600);  // SETPOINT
  return write_multiple_registers(unit, holding_address(spec::kRegCmd), values);
}

ModbusRequest nearly_stop(Rng& rng, std::uint8_t unit, const Choices& choices) {
  std::vector<std::uint8_t> bytes = body(order<spec::kCmdStop>(rng, unit, choices));
  bytes.back() ^= static_cast<std::uint8_t>(1u << rng.below(8));
  return with_crc(bytes);
}

ModbusRequest unlock(Rng&, std::uint8_t unit, const Choices&) {
  return write_single_register(unit, holding_address(spec::kRegLock), 0);
}

ModbusRequest read_all(Rng& rng, std::uint8_t unit, const Choices&) {
  constexpr std::uint16_t kMost = 32;  // that one request may ask for
  static_assert(spec::kInputCount >= kMost);
  return read_input_registers(unit, one_in(rng, 2) ? 0 : spec::kInputCount - kMost, kMost);
}

ModbusRequest read_some(Rng& rng, std::uint8_t unit, const Choices&) {
  if (one_in(rng, 2)) return read_input_registers(unit, below16(rng, 28), below16(rng, 36));
  const unsigned first = one_in(rng, 4) ? unsigned{spec::kRegCmd} : below16(rng, 62);
  return read_holding_registers(unit, holding_address(first), below16(rng, 36));
}

ModbusRequest set_one(Rng& rng, std::uint8_t unit, const Choices& choices) {
  if (choices.empty()) return read_all(rng, unit, choices);
  std::size_t i = rng.below(choices.size());
  const spec::Reg first = choices[i].reg;
  std::vector<std::uint16_t> values{chosen(rng, choices[i])};
  while (++i < choices.size() && choices[i].reg == first + values.size() && values.size() < 16 &&
         !one_in(rng, 6))
    values.push_back(chosen(rng, choices[i]));
  return values.size() == 1 ? write_single_register(unit, holding_address(first), values[0])
                            : write_multiple_registers(unit, holding_address(first), values);
}

ModbusRequest identify(Rng& rng, std::uint8_t unit, const Choices&) {
  return read_device_identification(unit, static_cast<std::uint8_t>(rng.below(6)),
                                    static_cast<std::uint8_t>(rng.below(5)));
}

ModbusRequest server_id(Rng&, std::uint8_t unit, const Choices&) { return report_server_id(unit); }

ModbusRequest echo(Rng& rng, std::uint8_t unit, const Choices&) { return diagnostic_echo(unit, any16(rng)); }

ModbusRequest wrong_length(Rng& rng, std::uint8_t unit, const Choices& choices) {
  const ModbusRequest sound[] = {
      read_input_registers(unit, 0, 2),
      read_holding_registers(unit, holding_address(spec::kRegSetpoint), 2),
      write_single_register(unit, holding_address(spec::kRegAtDwell), 1),
      diagnostic_echo(unit, any16(rng)),
      write_multiple_registers(unit, holding_address(spec::kRegAtWindow), {{1, 2}}),
      report_server_id(unit),
      identify(rng, unit, choices)};
  std::vector<std::uint8_t> bytes = body(sound[rng.below(std::size(sound))]);
  switch (rng.below(4)) {
    case 0:
      if (bytes.size() > 2) bytes.pop_back();
      break;
    case 1:
      bytes.resize(2 + rng.below(bytes.size()));
      break;
    default:
      bytes.push_back(static_cast<std::uint8_t>(rng.bits()));
      break;
  }
  return with_crc(bytes);
}

ModbusRequest wrong_function(Rng& rng, std::uint8_t unit, const Choices& choices) {
  const bool diagnostic = one_in(rng, 2);
  std::vector<std::uint8_t> bytes =
      body(diagnostic ? echo(rng, unit, choices) : identify(rng, unit, choices));
  bytes[diagnostic ? 2 + rng.below(2) : 2] ^= static_cast<std::uint8_t>(1u << rng.below(8));
  return with_crc(bytes);
}

ModbusRequest anything(Rng& rng, std::uint8_t unit, const Choices& choices) {
  const auto to = static_cast<std::uint8_t>(one_in(rng, 12) ? 0 : one_in(rng, 12) ? rng.below(256) : unit);
  switch (rng.below(15)) {
    case 0:
    case 1:
      return read_some(rng, to, choices);
    case 2:
    case 3:
    case 4:
      return write_single_register(to, holding_address(spec::kRegCmd),
                                   kCommands[rng.below(kCommands.size())]);
    case 5:
    case 6:
    case 7:
      return write_random_register(rng, to);
    case 8:
    case 9:
      return write_random_block(rng, to);
    case 10:
      return echo(rng, to, choices);
    case 11:
      return server_id(rng, to, choices);
    case 12:
      return identify(rng, to, choices);
    case 13:
      return one_in(rng, 2) ? wrong_length(rng, to, choices) : wrong_function(rng, to, choices);
    default:
      return unknown_function(rng, to);
  }
}

void damage(Rng& rng, ModbusRequest& request) {
  auto& frame = request.frame;
  switch (rng.below(7)) {
    case 0:
      frame[rng.below(frame.size())].data ^= static_cast<std::uint8_t>(1u << rng.below(8));
      break;
    case 1:
      frame.resize(1 + rng.below(frame.size()));
      break;
    case 2:
      frame[rng.below(frame.size())].gap_bits = static_cast<double>(rng.below(80));
      break;
    case 3:
      frame[rng.below(frame.size())].wrong_parity = true;
      break;
    case 4:
      frame[rng.below(frame.size())].missing_stop = true;
      break;
    case 5: {  // the next frame without a gap
      const ModbusRequest merged = read_input_registers(frame[0].data, 0, 1);
      frame.insert(frame.end(), merged.frame.begin(), merged.frame.end());
      break;
    }
    default:
      for (std::uint64_t n = 1 + rng.below(40); n > 0; --n)
        frame.push_back({.data = static_cast<std::uint8_t>(rng.bits())});
      break;
  }
}

}  // namespace meltstage::tb
