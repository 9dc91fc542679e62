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

// The columns follow by what the write changes.
void write(Rows& set, unsigned index, std::uint16_t data) {
  if (index == 0 || index >= spec::kMemColumns) return;
  const spec::RegisterInfo& info = spec::kHolding[index];
  const std::uint32_t row =
      mem_row(info.corrected, static_cast<std::uint16_t>(data ^ static_cast<std::uint16_t>(info.reset)));
  take(set, spec::kMemColumns, moved(set, spec::kMemColumns) ^ moved(set, index) ^ row);
  take(set, index, row);
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
  write(staged_q, index, value);
  write(active_q, index, value);
  refresh_params();
}

void Mem::step(const MemIn& in) {
  if (idle(in)) return;
  const bool starts = in.discard || (in.scrub_start && scrub_busy_q == 0);

  if (scrub_busy_q != 0 && !in.wr && !in.commit && !in.rd) walk();
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
  if (in.commit) {
    active_q = staged_q;
    refresh_params();
  }
  if (in.wr && !in.commit) write(staged_q, in.wr_index, in.wr_data);
}

void Mem::begin_walk() {
  scrub_index_q = 1;
  syndrome_q = 0;
  odd_row_q = 0;
  odd_rows_q = 0;
}

void Mem::walk() {
  if (scrub_index_q > spec::kMemColumns) {
    judge();
    begin_walk();
    return;
  }
  const bool copies = scrub_staged_q != 0 && discarding_q != 0;
  const std::uint32_t row = moved(scrub_staged_q != 0 && !copies ? staged_q : active_q, scrub_index_q);
  if (copies) take(staged_q, scrub_index_q, row);
  syndrome_q ^= row;
  if (std::popcount(row) % 2 != 0) {
    if (odd_row_q == 0)
      odd_row_q = scrub_index_q;
    else
      odd_rows_q = 1;
  }
  scrub_index_q = (scrub_index_q + 1) & 0x3F;
}

void Mem::judge() {
  const bool at_staged = scrub_staged_q != 0;
  const bool sound = syndrome_q == 0 && odd_row_q == 0;
  const bool fix = odd_row_q != 0 && odd_rows_q == 0 && std::has_single_bit(syndrome_q);
  const std::uint32_t mended =
      moved(at_staged && discarding_q == 0 ? staged_q : active_q, odd_row_q) ^ syndrome_q;
  if (at_staged && fix) take(staged_q, odd_row_q, mended);
  if (!at_staged && fix) {
    take(active_q, odd_row_q, mended);
    refresh_params();
  }
  if (fix) ++corrected_q;
  const bool bad_now = !sound && !fix && again_q != 0;
  const bool settled = sound || fix || again_q != 0;
  const bool bad_pass = scrub_bad_q != 0 || bad_now;
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
