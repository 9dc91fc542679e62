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
  const bool change = in.wr || in.commit || in.discard;

  if (scrub_busy_q == 0) {
    if (in.scrub_start) {
      scrub_busy_q = 1;
      scrub_index_q = 1;
      scrub_bad_q = 0;
    }
  } else if (!change) {
    scrub();
  }
  if (in.commit) {
    active_q = staged_q;
    refresh_params();
  } else if (in.discard) {
    staged_q = active_q;
  }
  if (in.wr && in.wr_index >= 1 && in.wr_index <= kLastIndex)
    staged_q[in.wr_index] = kept(in.wr_index, secded_encode(in.wr_data));
}

void Mem::scrub() {
  const unsigned i = scrub_index_q;
  const std::uint32_t staged = i <= kLastIndex ? staged_q[i] : 0;  // an upset of the index reads a clean zero
  const std::uint32_t active = i <= kLastIndex ? active_q[i] : 0;
  const std::uint32_t flip_staged = secded_flip(staged);
  const std::uint32_t flip_active = secded_flip(active);
  const bool bad_now = secded_bad(staged) || secded_bad(active);
  if (flip_staged != 0) {
    staged_q[i] = kept(i, staged ^ flip_staged);
    ++corrected_q;
  }
  if (flip_active != 0) {
    set_active(i, active ^ flip_active);
    ++corrected_q;
  }
  const bool bad_pass = scrub_bad_q != 0 || bad_now;
  scrub_bad_q = bad_pass;
  if (bad_now) bad_q = 1;
  if (i >= kLastIndex) {
    scrub_busy_q = 0;
    scrub_index_q = 0;
    bad_q = bad_pass;
  } else {
    ++scrub_index_q;
  }
}

}  // namespace meltstage::chip
