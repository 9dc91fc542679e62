// SPDX-License-Identifier: Apache-2.0
// MEM, the parameter memory; twin of rtl/tc_mem.sv, theory of operation in docs/chip/blocks/mem.md.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "flops.hpp"
#include "params.hpp"
#include "spec.hpp"

namespace meltstage::chip {

#define TC_MEM_FLOPS(X)                 \
  X(std::uint8_t, scrub_busy_q, 1, 0)   \
  X(std::uint8_t, scrub_index_q, 6, 1)  \
  X(std::uint8_t, scrub_staged_q, 1, 0) \
  X(std::uint8_t, discarding_q, 1, 0)   \
  X(std::uint8_t, again_q, 1, 0)        \
  X(std::uint8_t, scrub_bad_q, 1, 0)    \
  X(std::uint8_t, bad_q, 1, 0)          \
  X(std::uint32_t, syndrome_q, 22, 0)   \
  X(std::uint8_t, odd_row_q, 6, 0)      \
  X(std::uint8_t, odd_rows_q, 1, 0)     \
  X(std::uint16_t, corrected_q, 16, 0)

// Rows as stored, check bits above the data; index = holding register index, entry 0 (CMD) does not exist
// and stays 0. The bits of mem_stored(index) can change, the others are those of any value in range.
#define TC_MEM_ARRAYS(X)                                          \
  X(std::uint32_t, staged_q, meltstage::chip::spec::kMemRows, 22) \
  X(std::uint32_t, active_q, meltstage::chip::spec::kMemRows, 22)

// Bits of row `index` that are flops.
constexpr std::uint32_t mem_stored(unsigned index) {
  return index == spec::kMemColumns ? spec::kColumnsStored : spec::kHolding[index].stored;
}

struct MemIn {
  bool wr = false;  // not taken in a clock of a commit
  std::uint8_t wr_index = 0;
  std::uint16_t wr_data = 0;  // in the register's range
  bool commit = false;
  bool discard = false;
  bool rd = false;  // the host's read has the way: the pass stands still
  std::uint8_t rd_index = 0;
  bool scrub_start = false;
};

// The row in hand in a clock: the one that is written or read, else the one under the pass.
struct MemRow {
  std::uint8_t index = 0;
  std::uint32_t moved = 0;  // what differs from its reset value; nothing where there is no row

  std::uint16_t data() const {
    return index < spec::kHoldingCount
               ? static_cast<std::uint16_t>(moved ^ static_cast<unsigned>(spec::kHolding[index].reset))
               : std::uint16_t{0};
  }
};

struct Mem {
  TC_MEM_FLOPS(TC_DECLARE_FLOP)
  TC_MEM_ARRAYS(TC_DECLARE_ARRAY)

  // Reset state: both sets hold the registers' reset values.
  Mem();

  // One rising clock edge, not in reset, with the row in hand before it.
  void step(const MemIn& in, const MemRow& row);
  void step(const MemIn& in) { step(in, in_hand(in)); }
  MemRow in_hand(const MemIn& in) const;
  // Past the clock of a discard, until each staged word has taken the active one.
  bool discarding() const { return (scrub_busy_q & discarding_q) != 0; }
  // Nothing counts between two passes: there is nothing to skip.
  std::uint64_t quiet(const MemIn& in) const { return idle(in) ? kForever : 0; }

  // Read port of the staged set: data of word `index`, 0 for index 0 and beyond the map.
  std::uint16_t rd_data(unsigned index) const {
    return index < spec::kHoldingCount ? static_cast<std::uint16_t>(staged_q[index]) : std::uint16_t{0};
  }
  const Params& params() const { return params_; }
  std::uint16_t t_max_staged() const { return rd_data(spec::kRegTMax); }
  bool scrub_busy() const { return scrub_busy_q != 0; }
  bool bad() const { return bad_q != 0; }
  std::uint16_t corrected() const { return corrected_q; }

  // This value in both sets: a chip that begins with other settings.
  void preset(unsigned index, std::uint16_t value);
  // Makes params() follow active_q again; needed only by a caller that has changed active_q itself (fault
  // injection).
  void refresh_params();

 private:
  bool idle(const MemIn& in) const {
    return !in.wr && !in.commit && !in.discard && !in.scrub_start && scrub_busy_q == 0;
  }
  // The pass has gone by all rows of a set.
  bool judges() const { return scrub_index_q > spec::kMemColumns; }
  bool copies() const { return (scrub_staged_q & discarding_q) != 0; }
  void begin_walk();
  void walk(const MemRow& row);
  void judge(bool fix);

  Params params_;  // the data of active_q, kept beside it so that reading parameters costs nothing
};

// Bits of word `word` of a block's array, `width` wide, that are flops.
template <class Block>
constexpr std::uint32_t array_flops(unsigned word, unsigned width) {
  if constexpr (std::is_same_v<Block, Mem>) return mem_stored(word);
  return static_cast<std::uint32_t>((std::uint64_t{1} << width) - 1);
}

}  // namespace meltstage::chip
