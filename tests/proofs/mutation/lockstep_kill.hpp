// SPDX-License-Identifier: Apache-2.0
// Whether the random lockstep runs betray a variant of the RTL (input bug_i, variants.py). Include the
// headers of the Verilated top before this one, as for tb/lockstep/verilated_top.hpp.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "tb/lockstep/verilated_top.hpp"
#include "tb/stimulus/any_state.hpp"
#include "tb/stimulus/random_run.hpp"

namespace meltstage::tb {

// As the random lockstep test.
struct RunLength {
  std::uint64_t trials = 4'000'000;  // from any state
  std::uint64_t seeds = 50;
  std::uint64_t clocks = 300'000;
};

struct Kill {
  std::uint64_t seed = 0;   // 0: a trial from any state
  std::uint64_t clock = 0;  // of the run or of all trials, counted from 1
  std::string report;
};

// A Verilated tc_top in which bug_i chooses a variant; counts its clocks in `clocks`.
template <class Top>
class VariantRtl final : public verilated::VerilatedTop<Top> {
 public:
  VariantRtl(unsigned variant, std::uint64_t& clocks) : clocks_(clocks) {
    this->top_.bug_i = static_cast<std::uint16_t>(variant);
    this->set_assertions(false);  // what the comparison finds is asked
  }
  chip::Outputs step(const chip::Inputs& in) override {
    ++clocks_;
    return verilated::VerilatedTop<Top>::step(in);
  }

 private:
  std::uint64_t& clocks_;
};

// A variant as a device whose clocks are counted.
using MakeVariant = std::function<std::unique_ptr<VerilatedRtl>(unsigned variant, std::uint64_t& clocks)>;

template <class Top>
std::unique_ptr<VerilatedRtl> make_variant(unsigned variant, std::uint64_t& clocks) {
  return std::make_unique<VariantRtl<Top>>(variant, clocks);
}

// First trial or run in which model and variant differ, the heater breaks a safety rule or the bench gives
// up; none: the variant survived.
inline std::optional<Kill> killed_by(const MakeVariant& make, unsigned variant, const RunLength& length) {
  static const Moments moments(1, kMomentSeeds, kMomentClocks);
  std::uint64_t stepped = 0;
  try {
    const auto rtl = make(variant, stepped);
    step_from_any_state(moments, *rtl, 1, 0, length.trials);
  } catch (const Mismatch& error) {
    return Kill{0, stepped, error.what()};
  }
  for (std::uint64_t seed = 1; seed <= length.seeds; ++seed) {
    std::uint64_t clocks = 0;
    const auto make_one = [&] { return make(variant, clocks); };
    try {
      random_run(in_lockstep_with(make_one, random_start(seed), {"variant", seed, ""}), seed, length.clocks);
    } catch (const std::exception& error) {
      return Kill{seed, clocks, error.what()};
    }
  }
  return std::nullopt;
}

}  // namespace meltstage::tb
