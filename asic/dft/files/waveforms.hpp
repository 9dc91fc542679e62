// SPDX-License-Identifier: Apache-2.0
// What the waveforms of a pattern file do to their pins, and whether a stream of cycles can say it.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "asic/dft/core/cycles.hpp"

namespace meltstage::dft {

/// Within a cycle, at this time. Inputs: D low, U high, N, Z or X left open, P as before. Outputs: H, L, T
/// compared at once, h, l, t up to the next event; X, x not compared.
struct PinEvent {
  double ns;
  char state;
};

/// A waveform as a character of a stream's cycle.
struct PinWave {
  char state;             ///< inputs: 0, 1, P, N for an open one; outputs: L, H, T, X
  double from_ns, to_ns;  ///< drive edge (both); rise and fall of a pulse; begin and end of the strobe
};
/// Nothing when no character does that: an input that moves otherwise than to one level or through one pulse
/// low, high, low; an output that is compared twice.
std::optional<PinWave> wave_of(std::span<const PinEvent> events, bool is_input, double period_ns);

/// The waveforms that a pattern uses, against what a cycle of a stream is: inputs change, outputs are
/// compared, the clock pulses.
class UsedWaveforms {
 public:
  struct Defect {
    std::size_t where;
    std::string found, expected;
  };

  /// `letter` is what the file calls the waveform; 0, 1, P, H, L and X must do what they say, any other may
  /// do what it likes. `what` names it and its pin in a message, `where` is its place in the text. Returns
  /// the character that stands for it; nothing when there is none, which is a defect. Pulses of one `table`
  /// may be in one cycle.
  std::optional<char> add(char letter, const std::string& what, std::size_t where,
                          std::span<const PinEvent> events, bool is_input, double period_ns,
                          const void* table = nullptr);
  /// What the waveforms say of a cycle's times: the last drive edge, the first strobe, the first rise and the
  /// last fall of a clock.
  void set(TestTiming& timing) const;
  /// The first hundred at the most.
  std::vector<Defect> defects() const;

 private:
  struct Edge {
    double ns;
    std::string what;
    std::size_t where;
  };
  struct Pulse {
    Edge rise;
    double fall_ns;
  };
  std::optional<Edge> drive_, strobe_, strobe_end_, rise_, fall_;
  std::map<const void*, std::vector<Pulse>> pulses_;  // by table, one for each time
  std::vector<Defect> shapeless_;
};

}  // namespace meltstage::dft
