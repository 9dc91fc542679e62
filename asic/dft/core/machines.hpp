// SPDX-License-Identifier: Apache-2.0
// Up to 512 machines of one netlist side by side, clock by clock, each with faults and a power-up state of
// its own. Only what changes is evaluated. For the files of this folder that simulate.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "asic/dft/core/capture_view.hpp"
#include "asic/dft/core/faults.hpp"
#include "asic/dft/core/patterns.hpp"

namespace meltstage::dft {

/// Lane 0 is the good machine; fault k of those given is in lane k + 1. Flops with an asynchronous reset
/// follow it at once. Use: state() as wanted, start(), then inputs and clocks.
class Machines {
 public:
  /// At most 511 faults; one whose node is kNoNode leaves its machine as it is.
  Machines(const CaptureView& view, std::span<const Fault> faults);

  /// The flop's clock stands still in this machine.
  void stop_clock(std::size_t flop, std::size_t machine);

  std::size_t flops() const { return flops_.size(); }
  /// What a flop holds, machine by machine; to be written before start() only.
  Word& state(std::size_t flop) { return values_[flops_[flop].state]; }
  const Word& state(std::size_t flop) const { return values_[flops_[flop].state]; }
  /// What the inputs are at start(); 0 without. By input port.
  void preset_inputs(std::span<const std::uint8_t> inputs);
  void preset_inputs(std::span<const Word> inputs);
  /// All lines from the states and inputs. Lines have not toggled yet.
  void start();
  /// By input port; kept until the next call.
  void set_inputs(std::span<const std::uint8_t> inputs);
  /// The same, with a level of its own for each machine.
  void set_inputs(std::span<const Word> inputs);
  /// A rising edge of the clock, and what follows from it.
  void clock();
  /// Whether an output port may have changed in any machine since the last call.
  bool ports_changed();
  /// In which machines an output port differs from the good one's.
  Word different() const;
  /// In which of `machines` output port `port` is not at `level`.
  Word unlike(std::size_t port, bool level, const Word& machines) const;
  /// These become good machines: they cost nothing any more.
  void drop(const Word& machines);
  /// While on, changes of lines in which a machine differs from the good one are counted, by machine.
  void count_own_changes(bool on) { counting_ = on; }
  std::array<std::uint64_t, kLanes>& own_changes() { return own_changes_; }
  static constexpr std::uint8_t kRose = 1, kFell = 2;
  /// What the line has done in the good machine since start(); by node of the view's circuit.
  std::uint8_t moves(Node node) const;

  // A line as gates read it: its number times 2, plus 1 where it is read inverted.
  using Source = std::uint32_t;

 private:
  friend struct MachineSteps;

  enum class Kind : std::uint8_t { source, state, wire, both, differ, choice, all, parity, forced };
  // Gates are brought to AND, XOR and multiplexers of sources.
  struct Op {
    std::array<Source, 3> in{};  // all, parity: first of wide_, count; forced: index into forced_
    std::uint32_t fanout = 0, fanout_end = 0;
    Kind kind = Kind::source;
    bool inverted = false;  // the result
    bool resets = false;    // flops are reset by it
  };
  struct Stuck {  // a line stuck in some machines
    std::int32_t pin = kStem;
    Word machines, value;
  };
  struct Forced {  // a node with faults, evaluated as it stands in the circuit
    Gate kind = Gate::input;
    std::vector<Source> in;
    std::vector<Stuck> stuck;
  };
  struct Flop {
    std::uint32_t state = 0;
    Source next = 0;
    std::uint32_t reset = 0;  // index into resets_; 0: none
    bool reset_value = false;
    // Faults between the reset and the flop: of the inverter or buffer before the gate at its input, and of
    // that gate.
    std::int32_t through = -1, gate = -1;  // index into forced_, -1: none
    std::int32_t gate_pin = 0;
    bool through_inverter = false;
    std::int32_t stopped = -1;  // index into stopped_, -1: none
  };
  struct Reset {
    std::uint32_t line = 0;
    bool low = true;
    std::vector<std::uint32_t> flops;
    bool any = false;  // in any machine, or faults may hide that it is
  };

  bool is_kept(Node node) const { return number_[node] != kNoNumber; }
  void choose_kept();
  void number_nodes();
  void connect();
  Source source_of(Node node) const;
  void add_flops();
  void wake(std::uint32_t target) {
    pending_[target / 64] |= std::uint64_t{1} << (target % 64);
    words_[target / 4096] |= std::uint64_t{1} << (target / 64 % 64);
  }

  static constexpr std::uint32_t kNoNumber = ~std::uint32_t{0};
  const CaptureView& view_;
  const Circuit& circuit_;
  std::vector<std::uint32_t> number_;    // by node of the circuit; kNoNumber: folded into its readers
  std::vector<std::int32_t> forced_of_;  // by node of the circuit, index into forced_
  std::vector<Node> order_;              // nodes by number
  std::vector<Op> ops_;
  std::vector<Source> wide_;
  std::vector<std::uint32_t> fanout_;
  std::vector<Forced> forced_;
  std::vector<Flop> flops_;
  std::vector<Reset> resets_;
  std::vector<Word> stopped_;                                 // machines in which a flop isn't clocked
  std::vector<std::uint32_t> reset_of_line_, flop_of_state_;  // by number; 0: none, else a flop's index + 1
  std::vector<Source> ports_;
  std::vector<std::uint32_t> inputs_;
  std::vector<Word> values_;  // by number
  // A bit for each line to be evaluated, then for each flop that may change at the next clock, then one for
  // the ports; a bit for each word of these.
  std::vector<std::uint64_t> pending_, words_;
  std::uint32_t first_flop_bit_ = 0, port_bit_ = 0;
  bool again_ = false, counting_ = false;
  std::array<std::uint64_t, kLanes> own_changes_{};
  std::vector<std::uint8_t> moves_;  // of the good machine, by number
  struct Captured {
    std::uint32_t line;
    Word value;
  };
  std::vector<Captured> captured_;
};

}  // namespace meltstage::dft
