// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/masks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace meltstage::dft {

namespace {

constexpr const char* kPowerUp = "power-up: no load has been yet";
constexpr const char* kFirstUnload = "power-up: the chain shows what it held before the first load";
constexpr const char* kShift = "shift: the output follows what moves through the chains";
constexpr const char* kBehindChain = "unload: all cells of this shorter chain have been shown";
constexpr const char* kCell = "unload: the file expects no value of this cell";
constexpr const char* kUnclockedCell =
    "unload without a capture: the reset leaves this cell as it was loaded";
constexpr const char* kLaunch = "launch: the clock before the capture";
constexpr const char* kAtSpeed = "capture at speed: ports are not compared";
constexpr const char* kCapture = "capture: the file expects no value here";
constexpr const char* kNoClock = "between load and unload, without a clock";
constexpr const char* kUnsaid = "the file expects no value here";

// Why one output is masked in one cycle; which cell it shows then.
struct Cause {
  const char* reason = nullptr;  // null: compared
  const std::string* cell = nullptr;
  friend bool operator==(const Cause&, const Cause&) = default;
};

class Walker {
 public:
  Walker(const CycleStream& stream, const std::string& scan_enable) : stream_(stream) {
    const std::size_t signals = stream.signals.size();
    chain_of_.assign(signals, nullptr);
    for (std::size_t s = 0; s < signals; ++s) {
      if (stream.signals[s].name == scan_enable && stream.signals[s].is_input) enable_ = s;
      if (!stream.signals[s].is_input) outputs_.push_back(s);
      for (const ScanChain& chain : stream.chains) {
        if (chain.out == stream.signals[s].name) chain_of_[s] = &chain;
      }
    }
    for (const ScanChain& chain : stream.chains) longest_ = std::max(longest_, chain.cells.size());
    scan_ = !stream.chains.empty() && enable_ < signals;
    causes_.resize(outputs_.size());
  }

  std::vector<MaskedStrobes> run() {
    for (std::size_t i = 0; i < stream_.cycles.size(); ++i) {
      const TestCycle& cycle = stream_.cycles[i];
      if (!cycle.label.empty()) close();
      if (!cycle.label.empty()) label_ = cycle.label;
      // Each clock shows another cell while chains shift, and may be a launch or a capture when they don't.
      const bool each = scan_ && pulses(i);
      for (std::uint64_t left = each ? cycle.count : 1; left != 0; --left)
        take(i, each ? 1 : cycle.count, left == 1);
    }
    close();
    return std::move(masked_);
  }

 private:
  bool shifts(std::size_t i) const { return stream_.cycles[i].states[enable_] == '1'; }
  bool pulses(std::size_t i) const { return stream_.cycles[i].states.find('P') != std::string::npos; }
  // A clock follows before the chains shift again.
  bool clocked_again(std::size_t i) const {
    for (++i; i < stream_.cycles.size() && !shifts(i); ++i) {
      if (pulses(i)) return true;
    }
    return false;
  }

  // `last`: of cycle i's count.
  void take(std::size_t i, std::uint64_t count, bool last) {
    const bool shift = scan_ && shifts(i), pulse = pulses(i);
    // A load may follow another at once, as in the chain test.
    const bool again = pulse ? shifted_ >= longest_ : shifted_ != 0;
    if (shift && (!in_load_ || again)) {
      ++loads_;
      shifted_ = 0;
      captured_ = clocks_ != 0;
      clocks_ = 0;
    }
    in_load_ = shift;
    if (!shift && pulse) ++clocks_;
    std::vector<Cause> causes(outputs_.size());
    for (std::size_t o = 0; o < outputs_.size(); ++o) {
      const char c = stream_.cycles[i].states[outputs_[o]];
      if (c != 'H' && c != 'L') causes[o] = cause(i, chain_of_[outputs_[o]], shift, pulse, last);
    }
    if (causes != causes_) {
      close();
      causes_ = std::move(causes);
      first_ = at_;
    }
    at_ += count;
    if (shift && pulse) shifted_ += count;
  }
  Cause cause(std::size_t i, const ScanChain* chain, bool shift, bool pulse, bool last) const {
    if (!scan_) return {kUnsaid};
    if (shift) {
      if (chain == nullptr || !pulse) return {kShift};
      if (loads_ == 1) return {kFirstUnload};
      if (shifted_ >= chain->cells.size()) return {kBehindChain};
      return {captured_ ? kCell : kUnclockedCell, &chain->cells[chain->cells.size() - 1 - shifted_]};
    }
    if (loads_ == 0) return {kPowerUp};
    if (!pulse) return {kNoClock};
    return {!last || clocked_again(i) ? kLaunch : clocks_ > 1 ? kAtSpeed : kCapture};
  }
  // An entry a reason for what has been masked since `first_`.
  void close() {
    std::map<std::string, MaskedStrobes> entries;
    for (std::size_t o = 0; o < outputs_.size() && at_ != first_; ++o) {
      if (causes_[o].reason == nullptr) continue;
      const std::string& name = stream_.signals[outputs_[o]].name;
      MaskedStrobes& entry = entries[causes_[o].reason];
      entry.outputs.push_back(causes_[o].cell == nullptr ? name
                                                         : fmt::format("{} ({})", name, *causes_[o].cell));
    }
    for (auto& [reason, entry] : entries) {
      entry.first_cycle = first_;
      entry.cycles = at_ - first_;
      entry.label = label_;
      entry.reason = reason;
      masked_.push_back(std::move(entry));
    }
    first_ = at_;
  }

  const CycleStream& stream_;
  std::vector<std::size_t> outputs_;        // signals
  std::vector<const ScanChain*> chain_of_;  // by signal, of its scan output
  std::size_t enable_ = ~std::size_t{0}, longest_ = 0;
  bool scan_ = false;
  std::uint64_t at_ = 0, first_ = 0, shifted_ = 0;
  std::size_t loads_ = 0, clocks_ = 0;       // clocks since the load
  bool in_load_ = false, captured_ = false;  // captured_: with a clock between the load before and this one
  std::vector<Cause> causes_;
  std::string label_;
  std::vector<MaskedStrobes> masked_;
};

}  // namespace

std::vector<MaskedStrobes> masked_strobes(const CycleStream& stream, const std::string& scan_enable) {
  return Walker(stream, scan_enable).run();
}

MaskSummary summary(const std::vector<MaskedStrobes>& masked) {
  MaskSummary result;
  for (const MaskedStrobes& entry : masked) {
    result.masked += entry.strobes();
    result.reasons[entry.reason] += entry.strobes();
  }
  return result;
}

std::string mask_text(const std::vector<MaskedStrobes>& masked) {
  std::string text;
  const auto out = std::back_inserter(text);
  for (const MaskedStrobes& entry : masked) {
    if (entry.cycles == 1)
      fmt::format_to(out, "cycle {}", entry.first_cycle);
    else
      fmt::format_to(out, "cycles {} to {}", entry.first_cycle, entry.first_cycle + entry.cycles - 1);
    if (!entry.label.empty()) fmt::format_to(out, " ({})", entry.label);
    text += ':';
    for (const std::string& output : entry.outputs) fmt::format_to(out, " {}", output);
    fmt::format_to(out, ": {}\n", entry.reason);
  }
  return text;
}

}  // namespace meltstage::dft
