// SPDX-License-Identifier: Apache-2.0
// Toggle coverage: which flop bits have risen and which have fallen by themselves, from clock to clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"

namespace meltstage::tb {

class FlopToggles {
 public:
#define TC_FLOP(type, name, width, reset) +1
#define TC_ARRAY(type, name, count, width) +(count)
  static constexpr std::size_t kWords = 0
#include "cmodel/for_each_flop.inc"
      ;

  // A clock after the state that was seen last.
  void observe(const chip::Chip& now);
  // Goes on from another state: what differs has not switched by itself.
  void resume(const chip::Chip& state);
  // Adds what another run has seen.
  void add(const FlopToggles& other);

  struct Block {
    std::string name;
    unsigned bits = 0;
    unsigned switched = 0;  // both ways
  };
  // Block by block, in the order of the source.
  std::vector<Block> blocks() const;
  // Names of the bits that have not switched both ways: "guard.fault_q[3]: never fell".
  std::vector<std::string> still() const;

  // Bits of each word (a flop, or an array's word) that have risen and fallen.
  std::array<std::uint64_t, kWords> rose{}, fell{};

 private:
  std::array<std::uint64_t, kWords> last_{};
};

}  // namespace meltstage::tb
