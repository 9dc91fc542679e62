// SPDX-License-Identifier: Apache-2.0
#include "mem.hpp"

#include "math.hpp"

namespace meltstage::chip {
namespace {

constexpr unsigned kLastIndex = spec::kHoldingCount - 1;

constexpr std::array<std::uint32_t, spec::kHoldingCount> reset_words() {
  std::array<std::uint32_t, spec::kHoldingCount> words{};
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) {
    words[i] = secded_encode(static_cast<std::uint16_t>(spec::kHolding[i].reset));
  }
  return words;
}
constexpr auto kResetWords = reset_words();

// `word` with the bits that its register's range leaves no choice.
constexpr std::uint32_t kept(unsigned index, std::uint32_t word) {
  const std::uint32_t stored = spec::kHolding[index].stored;
  return (word & stored) | (kResetWords[index] & ~stored);
}

// What the blocks see of a word. A flip of these three would outlast the pass that corrects it: in the
// control period, or in a PWM period begun with it.
std::uint16_t parameter(unsigned index, std::uint32_t word) {
  const bool lasting =
      index == spec::kRegTs || index == spec::kRegPwmPrescale || index == spec::kRegPwmPeriod;
  return static_cast<std::uint16_t>(lasting ? word ^ secded_flip(word) : word);
}

}  // namespace

Mem::Mem() : staged_q(kResetWords), active_q(kResetWords) { refresh_params(); }

void Mem::refresh_params() {
  for (unsigned i = 1; i < spec::kHoldingCount; ++i) params_.value[i] = parameter(i, active_q[i]);
}

void Mem::set_active(unsigned index, std::uint32_t word) {
  active_q[index] = kept(index, word);
  params_.value[index] = parameter(index, active_q[index]);
}

void Mem::step(const MemIn& in) {
  if (idle(in)) return;
  const bool starts = in.discard || (in.scrub_start && scrub_busy_q == 0);

  if (scrub_busy_q != 0 && !in.wr && !in.commit && !in.rd) scrub();
  if (starts) {
    scrub_busy_q = 1;
    scrub_index_q = 1;
    scrub_active_q = 0;
    discarding_q = in.discard ? 1 : 0;
    scrub_bad_q = 0;
  }
  if (in.commit) {
    active_q = staged_q;
    refresh_params();
  }
  if (in.wr && in.wr_index >= 1 && in.wr_index <= kLastIndex)
    staged_q[in.wr_index] = kept(in.wr_index, secded_encode(in.wr_data));
}

void Mem::scrub() {
  const unsigned i = scrub_index_q;
  const bool at_active = scrub_active_q != 0;
  const bool shows_active = at_active || discarding_q != 0;
  const bool stored = i >= 1 && i <= kLastIndex;  // an upset of the index reads a clean word
  const std::uint32_t word = !stored ? 0 : shows_active ? active_q[i] : staged_q[i];
  const std::uint32_t flip = secded_flip(word);
  const bool bad_now = secded_bad(word);
  if (stored && !at_active) staged_q[i] = kept(i, word ^ flip);
  if (stored && shows_active) set_active(i, word ^ flip);
  if (flip != 0) ++corrected_q;
  const bool bad_pass = scrub_bad_q != 0 || bad_now;
  scrub_bad_q = bad_pass;
  if (bad_now) bad_q = 1;
  scrub_active_q = at_active ? 0 : 1;
  if (!at_active) return;
  scrub_index_q = (scrub_index_q + 1) & 0x3F;
  if (i >= kLastIndex) {
    scrub_busy_q = 0;
    discarding_q = 0;
    bad_q = bad_pass;
  }
}

}  // namespace meltstage::chip
