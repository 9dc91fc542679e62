// SPDX-License-Identifier: Apache-2.0
// The part of a test that its fault needs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "asic/dft/core/faults.hpp"
#include "asic/dft/core/patterns.hpp"

namespace meltstage::dft {

/// The inputs that a test needs at a value; the others are free. Ascending by input.
using Cube = std::vector<std::pair<std::uint32_t, bool>>;

/// One worker's memory; the circuit must outlive it.
class CubeLifter {
 public:
  explicit CubeLifter(const Circuit& circuit);

  /// Which inputs keep the difference at the output `target`, traced back from there through the good and the
  /// faulty circuit: a controlling input justifies a gate by itself, otherwise all inputs do. `good` and
  /// `bad` give a node's value without and with the fault: 0, 1, or above that where it is unknown and not
  /// needed. Held inputs are left out.
  template <class Good, class Bad>
  void lift(const Fault& fault, Node target, const Good& good, const Bad& bad, Cube& cube);

  /// The same for one lane of a block whose fault-free values are known; false when the lane doesn't detect
  /// the fault. The target is the first output that the fault reaches.
  bool lift_lane(const Fault& fault, const std::vector<Word>& values, std::size_t lane, Cube& cube);

 private:
  static constexpr std::uint8_t kGood = 1, kBad = 2;
  void require(Node node, std::uint8_t which) {
    need_[node] |= which;
    pending_[node / 64] |= std::uint64_t{1} << (node % 64);
  }
  Node first_difference(const Fault& fault, const std::vector<Word>& values, std::size_t lane);

  const Circuit& circuit_;
  std::vector<std::uint32_t> input_of_;  // circuit input of a node
  std::vector<std::uint8_t> need_;       // kGood, kBad; all 0 between calls
  std::vector<std::uint64_t> pending_;   // a bit a node; all 0 between calls
  std::vector<std::uint32_t> changed_;   // == now_: the fault changes the node
  std::uint32_t now_ = 0;
  std::vector<Node> touched_;
};

template <class Good, class Bad>
void CubeLifter::lift(const Fault& fault, Node target, const Good& good, const Bad& bad, Cube& cube) {
  require(target, kGood | kBad);
  require(fault.pin == kStem ? fault.node : circuit_.fanin(fault.node)[static_cast<std::size_t>(fault.pin)],
          kGood);
  if (fault.launch != kNoNode) require(fault.launch, kGood);
  cube.clear();
  for (std::size_t word = pending_.size(); word-- > 0;) {
    while (pending_[word] != 0) {
      const auto bit = static_cast<std::size_t>(63 - __builtin_clzll(pending_[word]));
      pending_[word] ^= std::uint64_t{1} << bit;
      const Node node = static_cast<Node>(64 * word + bit);
      touched_.push_back(node);
      const auto fanin = circuit_.fanin(node);
      const Gate kind = circuit_.kind(node);
      const bool is_stem = node == fault.node && fault.pin == kStem;
      if (kind == Gate::input && circuit_.held()[input_of_[node]] < 0 && (!is_stem || (need_[node] & kGood)))
        cube.emplace_back(input_of_[node], good(node) == 1);
      for (const std::uint8_t which : {kGood, kBad}) {
        if ((need_[node] & which) == 0 || fanin.empty() || (which == kBad && is_stem)) continue;
        // an input that is itself the faulty line reads the stuck value and needs nothing
        const auto is_stuck = [&](std::size_t pin) {
          return which == kBad && node == fault.node && static_cast<std::int32_t>(pin) == fault.pin;
        };
        const auto value = [&](std::size_t pin) -> std::uint8_t {
          if (is_stuck(pin)) return fault.stuck ? 1 : 0;
          return which == kGood ? good(fanin[pin]) : bad(fanin[pin]);
        };
        const auto take = [&](std::size_t pin) {
          if (!is_stuck(pin)) require(fanin[pin], which);
        };
        if (kind == Gate::mux) {
          if (value(2) > 1) {  // whatever it selects is the same
            take(0);
            take(1);
          } else {
            take(2);
            take(value(2));
          }
          continue;
        }
        const bool has_controlling =
            kind == Gate::all || kind == Gate::nall || kind == Gate::any || kind == Gate::none;
        const std::uint8_t controlling = kind == Gate::any || kind == Gate::none ? 1 : 0;
        std::size_t choice = fanin.size();
        for (std::size_t pin = 0; has_controlling && pin < fanin.size(); ++pin) {
          if (value(pin) != controlling) continue;
          const bool free = is_stuck(pin) || need_[fanin[pin]] != 0;
          if (choice == fanin.size() || free ||
              (need_[fanin[choice]] == 0 && circuit_.level(fanin[pin]) < circuit_.level(fanin[choice])))
            choice = pin;
          if (free) break;
        }
        if (choice != fanin.size()) {
          take(choice);
        } else {
          for (std::size_t pin = 0; pin < fanin.size(); ++pin) take(pin);
        }
      }
    }
  }
  for (const Node node : touched_) need_[node] = 0;
  touched_.clear();
  std::sort(cube.begin(), cube.end());
}

}  // namespace meltstage::dft
