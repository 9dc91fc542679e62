// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/still_bits.hpp"

#include <utility>

#include "tb/pins/flop_table.hpp"
#include "tb/stimulus/decision_edge.hpp"

namespace meltstage::tb {

namespace {

constexpr std::size_t kKept = 4;  // moments of a flop and a direction

// One of the block's flops may tell which word of an array is written: by its number, or by that of a byte of
// it, counted from anywhere.
void readdress(Rng& rng, const FlopBlock& block, std::uint64_t words, chip::Chip& chip) {
  const Flop& flop = block[rng.below(block.size())][0];
  if (flop.is_array) return;
  const std::uint64_t moved = one_in(rng, 2) ? words : 2 * words + rng.below(2);
  set_flop(flop, flop.get(chip, flop.word) + moved, chip);
}

}  // namespace

bool Aim::switches() const {
  chip::Chip stepped = moment.chip;
  stepped.step(moment.in);
  return ((flop->get(moment.chip, flop->word) ^ flop->get(stepped, flop->word)) >> bit & 1) != 0;
}

StillBits::StillBits() : lately_(kFlopPlaces) {}

void StillBits::observe(const chip::Chip& before, const chip::Inputs& in, const chip::Chip& after) {
  toggles_.add(before, in, after);
  if (!before.out_of_reset(in)) return;
  for_each_changed(before, after, [&](const Flop& flop) {
    const bool grows = flop.get(after, flop.word) > flop.get(before, flop.word);
    Lately& kept = lately_[flop.place][grows];
    if (kept.moments.size() == kKept && toggles_.still(flop) == 0) return;
    const std::size_t place = kept.met++ % kKept;
    if (place == kept.moments.size()) kept.moments.emplace_back();
    kept.moments[place] = {before, in, flop.block, {}, {}};
  });
}

const Flop& StillBits::any_flop(Rng& rng) const {
  const std::vector<const Flop*>& flops = flops_in_order();
  while (true)
    if (const Flop* flop = flops[rng.below(flops.size())]) return *flop;
}

std::optional<Aim> StillBits::aim(Rng& rng) const {
  constexpr unsigned kDraws = 200;  // till one has a still bit: most flops have none after a while
  const Flop* flop = &any_flop(rng);
  if (one_in(rng, 2))
    for (unsigned draw = 0; draw < kDraws && toggles_.still(*flop) == 0; ++draw) flop = &any_flop(rng);
  const std::uint64_t still = toggles_.still(*flop);
  auto bit = static_cast<unsigned>(rng.below(flop->width));
  while (still != 0 && (still >> bit & 1) == 0) bit = (bit + 1) % flop->width;
  const bool rises = (toggles_.rose[flop->place] >> bit & 1) == 0 || one_in(rng, 2);
  std::optional<Moment> moment = any_lately(rng, *flop, rises);
  if (!moment) return std::nullopt;
  Aim aim{flop, bit, *std::move(moment)};
  const std::uint64_t own = std::uint64_t{1} << bit;
  const std::uint64_t counted = rises ? own - 1 : own;
  const std::uint64_t loaded = rises ? rng.bits() & ~own : rng.bits() | own;
  set_flop(*flop, one_in(rng, 2) ? counted : loaded, aim.moment.chip);
  return aim;
}

bool StillBits::is_still(const Aim& aim) const {
  const bool set = (aim.flop->get(aim.moment.chip, aim.flop->word) >> aim.bit & 1) != 0;
  const std::uint64_t switched = set ? toggles_.fell[aim.flop->place] : toggles_.rose[aim.flop->place];
  return (switched >> aim.bit & 1) == 0;
}

// Of the flop itself; or, for the word of an array, of another word, with another number of it.
std::optional<Moment> StillBits::any_lately(Rng& rng, const Flop& flop, bool grows) const {
  const bool of_another_word = flop.is_array && one_in(rng, 3);
  const std::size_t before = of_another_word ? rng.below(flop.word + 1) : 0;
  const std::vector<Moment>& moments = lately_[flop.place - before][grows].moments;
  if (moments.empty()) return std::nullopt;
  Moment moment = moments[rng.below(moments.size())];
  if (of_another_word) readdress(rng, flop_blocks()[flop.block], before, moment.chip);
  return moment;
}

}  // namespace meltstage::tb
