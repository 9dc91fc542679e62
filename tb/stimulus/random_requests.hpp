// SPDX-License-Identifier: Apache-2.0
// What a random host sends: requests of every form, right and wrong.
#pragma once

#include <cstdint>
#include <vector>

#include "base/rng.hpp"
#include "tb/lockstep/bench.hpp"

namespace meltstage::tb {

// Values that a register is given, at the start and by the host; one that stands there twice is twice as
// likely.
struct Choice {
  spec::Reg reg;
  std::vector<std::uint16_t> values;
};
using Choices = std::vector<Choice>;

// One value for each register of the list.
Settings draw(Rng& rng, const Choices& choices);

using MakeRequest = ModbusRequest (*)(Rng& rng, std::uint8_t unit, const Choices& choices);

// One kind of request and how often it is drawn among the others of its mix.
struct Share {
  unsigned weight;
  MakeRequest make;
};
using Mix = std::vector<Share>;

ModbusRequest draw(Rng& rng, const Mix& mix, std::uint8_t unit, const Choices& choices);

inline std::uint16_t holding_address(unsigned reg) {
  return static_cast<std::uint16_t>(spec::kHoldingBase + reg);
}

// CMD register.
template <spec::Cmd Command>
ModbusRequest order(Rng&, std::uint8_t unit, const Choices&) {
  return write_single_register(unit, holding_address(spec::kRegCmd), Command);
}
// Any command by function code 16, which takes no short cut to the heater as STOP by 06 does; sometimes with
// a register behind it.
ModbusRequest order_by_block(Rng& rng, std::uint8_t unit, const Choices& choices);
// STOP by 06 but for one bit of its last data byte, with a sound CRC: must take no short cut to the heater.
ModbusRequest nearly_stop(Rng& rng, std::uint8_t unit, const Choices& choices);
ModbusRequest unlock(Rng& rng, std::uint8_t unit, const Choices& choices);
// Input registers, as many of the first or the last as one request may ask for, or some of them, also past
// their end; holding registers, often from CMD on.
ModbusRequest read_all(Rng& rng, std::uint8_t unit, const Choices& choices);
ModbusRequest read_some(Rng& rng, std::uint8_t unit, const Choices& choices);
// One register of the list, or a few that follow each other in the map.
ModbusRequest set_one(Rng& rng, std::uint8_t unit, const Choices& choices);
ModbusRequest identify(Rng& rng, std::uint8_t unit, const Choices& choices);
ModbusRequest server_id(Rng& rng, std::uint8_t unit, const Choices& choices);
ModbusRequest echo(Rng& rng, std::uint8_t unit, const Choices& choices);
// A sound CRC around a frame that is too long or too short for its function code.
ModbusRequest wrong_length(Rng& rng, std::uint8_t unit, const Choices& choices);
// A sub-function of 08 or an MEI type of 43 that the chip does not know.
ModbusRequest wrong_function(Rng& rng, std::uint8_t unit, const Choices& choices);
// Anything at all, to any register that does not slow everything to a crawl.
ModbusRequest anything(Rng& rng, std::uint8_t unit, const Choices& choices);

// What a bad line does to a frame.
void damage(Rng& rng, ModbusRequest& request);

// A value for a register: mostly inside its range, often at an end or beside it, sometimes anything.
std::uint16_t any_value(Rng& rng, unsigned index);
// Registers that a random host may write without slowing everything to a crawl.
bool writable(unsigned index);

}  // namespace meltstage::tb
