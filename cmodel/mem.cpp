// SPDX-License-Identifier: Apache-2.0
#include "mem.hpp"

#include <bit>

#include "math.hpp"

namespace meltstage::chip {
namespace {

using Rows = std::array<std::uint32_t, spec::kMemRows>;

constexpr Rows reset_rows() {
  Rows rows{};
  for (unsigned i = 1; i < spec::kHoldingCount; ++i)
    rows[i] = mem_row(spec::kHolding[i].corrected, static_cast<std::uint16_t>(spec::kHolding[i].reset));
  return rows;
}
constexpr Rows kResetRows = reset_rows();

constexpr bool is_row(unsigned index) { return index >= 1 && index < spec::kMemRows; }

// Of `row` what differs from its reset value; nothing where there is no row.
std::uint32_t moved(const Rows& set, unsigned index) {
  return is_row(index) ? set[index] ^ kResetRows[index] : 0;
}
void take(Rows& set, unsigned index, std::uint32_t difference) {
  if (is_row(index)) set[index] = (difference & mem_stored(index)) ^ kResetRows[index];
}

constexpr bool is_register(unsigned index) { return index >= 1 && index < spec::kHoldingCount; }

// What the row of a register is with these data; nothing where there is no register.
std::uint32_t row_of(unsigned index, std::uint16_t data) {
  if (!is_register(index)) return 0;
  const spec::RegisterInfo& info = spec::kHolding[index];
  return mem_row(info.corrected, static_cast<std::uint16_t>(data ^ static_cast<std::uint16_t>(info.reset)));
}

// What the blocks see of a word. A flip of some would outlast the pass that corrects it: in the control
// period, or in a PWM period begun with it.
std::uint16_t parameter(unsigned index, std::uint32_t word) {
  return static_cast<std::uint16_t>(spec::kHolding[index].corrected ? word ^ secded_flip(word) : word);
}

}  // namespace

Mem::Mem() : staged_q(kResetRows), active_q(kResetRows) { refresh_params(); }

void Mem::refresh_params() {
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) params_.value[i] = parameter(i, active_q[i]);
}

void Mem::preset(unsigned index, std::uint16_t value) {
  if (!is_register(index)) return;
  for (Rows* set : {&staged_q, &active_q}) {
    const std::uint32_t row = row_of(index, value);
    take(*set, spec::kMemColumns, moved(*set, spec::kMemColumns) ^ moved(*set, index) ^ row);
    take(*set, index, row);
  }
  refresh_params();
}

// One way to both sets, as the RTL has it: the circuit of this source has no more either.
MemRow Mem::in_hand(const MemIn& in) const {
  if (idle(in) && !in.rd) return {};
  const std::uint8_t index = in.wr ? in.wr_index : in.rd ? in.rd_index : judges() ? odd_row_q : scrub_index_q;
  const bool of_staged = in.wr || in.rd || (scrub_staged_q != 0 && discarding_q == 0);
  return {index, moved(of_staged ? staged_q : active_q, index)};
}

void Mem::step(const MemIn& in, const MemRow& row) {
  if (idle(in)) return;
  const bool starts = in.discard || (in.scrub_start && scrub_busy_q == 0);
  const bool passes = scrub_busy_q != 0 && !in.wr && !in.commit && !in.rd;
  const bool judging = passes && judges();
  const bool writes = in.wr && !in.commit && is_register(row.index);
  const bool fix = judging && odd_row_q != 0 && odd_rows_q == 0 && std::has_single_bit(syndrome_q);
  const bool copy = passes && !judges() && copies();

  const std::uint32_t taken = in.wr      ? row_of(row.index, in.wr_data)
                              : judges() ? row.moved ^ syndrome_q
                                         : row.moved;
  const std::uint32_t columns = moved(staged_q, spec::kMemColumns) ^ row.moved ^ taken;
  if (in.commit) active_q = staged_q;
  if (fix && scrub_staged_q == 0) take(active_q, row.index, taken);
  if (in.commit || fix) refresh_params();
  if (writes || copy || (fix && scrub_staged_q != 0)) take(staged_q, row.index, taken);
  if (writes) take(staged_q, spec::kMemColumns, columns);

  if (judging) {
    judge(fix);
    begin_walk();
  } else if (passes) {
    walk(row);
  }
  if (starts) {
    scrub_busy_q = 1;
    discarding_q = in.discard ? 1 : 0;
  }
  if (starts || in.wr || in.commit) {
    scrub_staged_q = 0;
    again_q = 0;
    scrub_bad_q = 0;
    begin_walk();
  }
}

void Mem::begin_walk() {
  scrub_index_q = 1;
  syndrome_q = 0;
  odd_row_q = 0;
  odd_rows_q = 0;
}

void Mem::walk(const MemRow& row) {
  syndrome_q ^= row.moved;
  if (std::popcount(row.moved) % 2 != 0) {
    if (odd_row_q == 0)
      odd_row_q = scrub_index_q;
    else
      odd_rows_q = 1;
  }
  scrub_index_q = (scrub_index_q + 1) & 0x3F;
}

// `fix`: the one flip of this set is put right.
void Mem::judge(bool fix) {
  const bool at_staged = scrub_staged_q != 0;
  const bool sound = syndrome_q == 0 && odd_row_q == 0;
  const bool bad_now = !sound && !fix && again_q != 0;
  const bool settled = sound || fix || again_q != 0;
  const bool bad_pass = scrub_bad_q != 0 || bad_now;
  if (fix) ++corrected_q;
  again_q = settled ? 0 : 1;
  scrub_bad_q = bad_pass;
  if (bad_now) bad_q = 1;
  if (!settled) return;
  scrub_staged_q = at_staged ? 0 : 1;
  if (!at_staged) return;
  scrub_busy_q = 0;
  discarding_q = 0;
  bad_q = bad_pass;
}

}  // namespace meltstage::chip
