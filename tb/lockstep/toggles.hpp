// SPDX-License-Identifier: Apache-2.0
// Toggle coverage: which flop bits have risen and which have fallen by themselves, from clock to clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"
#include "tb/pins/flop_table.hpp"

namespace meltstage::tb {

class FlopToggles {
 public:
  // A clock with these pins. What a reset does is not counted.
  void add(const chip::Chip& before, const chip::Inputs& in, const chip::Chip& after);
  // The same, after the state that was seen last.
  void observe(const chip::Inputs& in, const chip::Chip& now) {
    add(last_, in, now);
    last_ = now;
  }
  // Goes on from another state: what differs has not switched by itself.
  void resume(const chip::Chip& state);
  // The state that was seen last.
  const chip::Chip& last() const { return last_; }
  // Adds what another run has seen.
  void add(const FlopToggles& other);

  // Whether a flop was seen to switch.
  bool any() const { return rose != decltype(rose){} || fell != decltype(fell){}; }

  struct Block {
    std::string name;
    unsigned bits = 0;
    unsigned switched = 0;  // both ways
  };
  // Block by block, in the order of the source.
  std::vector<Block> blocks() const;
  // Names of the bits that have not switched both ways and could: "guard.fault_q[3]: never fell".
  std::vector<std::string> still() const;
  // Those bits of one flop.
  std::uint64_t still(const Flop& flop) const {
    return flop.changeable &
           ~((rose[flop.place] | never().rises[flop.place]) & (fell[flop.place] | never().falls[flop.place]));
  }

  // Bits that switch one way from no state whatever, but in a reset: never_switch.txt, proved by the test
  // hls.never_switch.
  struct Never {
    std::array<std::uint64_t, kFlopPlaces> rises{}, falls{};
    std::size_t count = 0;
  };
  static const Never& never();

  // Bits that have risen and fallen, by Flop::place.
  std::array<std::uint64_t, kFlopPlaces> rose{}, fell{};

 private:
  chip::Chip last_;
};

}  // namespace meltstage::tb
