// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/moments.hpp"

#include <algorithm>
#include <memory>

#include "tb/lockstep/bench.hpp"
#include "tb/stimulus/any_value.hpp"
#include "tb/stimulus/decision_edge.hpp"
#include "tb/stimulus/random_run.hpp"

namespace meltstage::tb {

namespace {

// The registers themselves.
bool is_mem(const FlopBlock& block) { return block[0][0].name.starts_with("mem."); }

// Whether a flop of the block is another.
bool differs(const FlopBlock& block, const chip::Chip& one, const chip::Chip& other) {
  return std::ranges::any_of(block, [&](const FlopWords& flops) {
    return std::ranges::any_of(
        flops, [&](const Flop& flop) { return flop.get(one, flop.word) != flop.get(other, flop.word); });
  });
}

template <class T>
const T& one_of(Rng& rng, const std::vector<T>& list) {
  return list[rng.below(list.size())];
}

}  // namespace

// The model alone, whose moments are kept.
class Collector final : public Device {
 public:
  Collector(const chip::Chip& start, Rng& rng, Moments& moments)
      : model_(start), rng_(rng), moments_(moments) {}

  chip::Outputs step(const chip::Inputs& in) override {
    const chip::Chip before = model_;
    const chip::Outputs out = model_.step(in);
    if (in.rst_n) {
      for (std::size_t block = 0; block < moments_.blocks_.size(); ++block) {
        for (Moments::Watched& watched : moments_.blocks_[block]) {
          const std::uint64_t becomes = watched.flop->get(model_, 0);
          if (becomes != watched.flop->get(before, 0)) keep(event(watched, becomes), before, in, block);
        }
      }
    }
    return out;
  }
  const chip::Chip& model() const override { return model_; }
  void restart(const chip::Chip& state, const chip::Inputs&) override { model_ = state; }
  Compared finish() override { return {}; }

 private:
  static constexpr std::size_t kKept = 6;  // moments of an event

  static Moments::Event& event(Moments::Watched& watched, std::uint64_t becomes) {
    const auto met = std::ranges::find(watched.events, becomes, &Moments::Event::value);
    return met == watched.events.end() ? watched.events.emplace_back(Moments::Event{becomes, 0, {}}) : *met;
  }

  // Reservoir sampling.
  void keep(Moments::Event& event, const chip::Chip& before, const chip::Inputs& in, std::size_t block) {
    const std::uint64_t place = event.met < kKept ? event.met : rng_.below(event.met + 1);
    ++event.met;
    if (place >= kKept) return;
    if (place == event.kept.size()) event.kept.emplace_back();
    event.kept[place] = {before, in, block, {}, {}};
  }

  chip::Chip model_;
  Rng& rng_;
  Moments& moments_;
};

Moments::Moments(std::uint64_t first, std::uint64_t seeds, std::uint64_t clocks) {
  for (const FlopBlock& block : flop_blocks()) {
    blocks_.emplace_back();
    for (const FlopWords& words : block)
      if (is_narrow(words[0])) blocks_.back().push_back({&words[0], {}});
  }
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    Rng rng = stream(seed, "moments");
    random_run(std::make_unique<Collector>(random_start(seed), rng, *this), seed, clocks);
  }
  std::vector<std::set<unsigned>> read_by(flop_blocks().size());
  for (auto& block : blocks_) {
    std::erase_if(block, [](const Watched& watched) { return watched.events.empty(); });
    for (Watched& watched : block)
      for (Event& event : watched.events)
        for (Moment& moment : event.kept) look_into(moment, read_by);
  }
  std::erase_if(blocks_, [](const auto& block) { return block.empty(); });
  for (const std::set<unsigned>& registers : read_by)
    read_by_.emplace_back(registers.begin(), registers.end());
}

const Moment& Moments::any(Rng& rng) const {
  const Watched& watched = one_of(rng, one_of(rng, blocks_));
  return one_of(rng, one_of(rng, watched.events).kept);
}

std::size_t Moments::events() const {
  std::size_t count = 0;
  for (const auto& block : blocks_)
    for (const Watched& watched : block) count += watched.events.size();
  return count;
}

// A block reads a register when another value of it makes another next state of the block. A flop steers a
// block when one of two drawn values takes it another way.
void Moments::look_into(Moment& moment, std::vector<std::set<unsigned>>& read_by) {
  Rng rng(0, "moment");
  const std::vector<FlopBlock>& blocks = flop_blocks();
  chip::Chip stepped = moment.chip;
  stepped.step(moment.in);
  for (unsigned index = 1; index < spec::kHoldingCount; ++index) {
    chip::Chip other = moment.chip;
    other.mem.preset(index, any_register_value(rng, index));
    other.step(moment.in);
    bool read = false;
    for (std::size_t block = 0; block < blocks.size(); ++block) {
      if (is_mem(blocks[block]) || !differs(blocks[block], stepped, other)) continue;
      read_by[block].insert(index);
      read = true;
    }
    if (read) moment.registers_read.push_back(index);
  }
  moment.steering.resize(blocks.size());
  std::vector<std::uint64_t> ways;
  for (const FlopBlock& block : blocks) ways.push_back(way_of_block(block, moment.chip, stepped));
  for (const FlopBlock& own : blocks) {
    if (is_mem(own)) continue;
    for (const FlopWords& words : own) {
      for (const Flop& flop : words) {
        std::vector<bool> steered(blocks.size());
        for (unsigned draw = 0; draw < 2; ++draw) {
          chip::Chip other = moment.chip;
          set_flop(flop, rng.bits() >> rng.below(64), other);
          chip::Chip after = other;
          after.step(moment.in);
          for (std::size_t block = 0; block < blocks.size(); ++block)
            steered[block] = steered[block] || way_of_block(blocks[block], other, after) != ways[block];
        }
        for (std::size_t block = 0; block < blocks.size(); ++block)
          if (steered[block]) moment.steering[block].push_back(&flop);
      }
    }
  }
}

}  // namespace meltstage::tb
