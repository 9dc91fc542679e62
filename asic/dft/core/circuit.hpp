// SPDX-License-Identifier: Apache-2.0
// The circuit that faults are simulated and tests are generated on: gates in topological order between inputs
// (ports and flop outputs) and outputs (ports and what flops capture).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace meltstage::dft {

using Node = std::uint32_t;
inline constexpr Node kNoNode = ~Node{0};
inline constexpr std::int32_t kStem = -1;  ///< a line that is the output of its node

enum class Gate : std::uint8_t {
  input,  ///< port or flop output; no fan-in
  tie0,   ///< constant 0
  tie1,   ///< constant 1
  buf,
  inv,
  all,     ///< AND
  nall,    ///< NAND
  any,     ///< OR
  none,    ///< NOR
  parity,  ///< XOR
  same,    ///< XNOR (of all inputs)
  mux,     ///< fan-in 0 when fan-in 2 is 0, else fan-in 1
  output   ///< port or what a flop captures; one fan-in, no fan-out
};

/// A place where a fault may sit and that is reported: a pin of a cell or a port.
struct Site {
  std::string name;          ///< "instance/PIN" or the port
  Node node = kNoNode;       ///< kNoNode: outside this circuit, such as a clock pin
  std::int32_t pin = kStem;  ///< fan-in of `node`, or kStem
  bool shifts = false;       ///< on the way by which chains shift: the chain test moves it both ways
};

/// Built by CircuitBuilder; read only after that.
class Circuit {
 public:
  std::size_t size() const { return kinds_.size(); }
  Gate kind(Node node) const { return kinds_[node]; }
  std::span<const Node> fanin(Node node) const {
    return {fanin_.data() + fanin_begin_[node], fanin_begin_[node + 1] - fanin_begin_[node]};
  }
  std::span<const Node> fanout(Node node) const {
    return {fanout_.data() + fanout_begin_[node], fanout_begin_[node + 1] - fanout_begin_[node]};
  }
  std::uint32_t level(Node node) const { return level_[node]; }
  /// Lines of a node's inputs are numbered through the circuit: first_input_line(node) + pin.
  std::uint32_t first_input_line(Node node) const { return fanin_begin_[node]; }
  std::size_t input_line_count() const { return fanin_.size(); }

  const std::vector<Node>& inputs() const { return inputs_; }    ///< in the order of the builder
  const std::vector<Node>& outputs() const { return outputs_; }  ///< likewise
  const std::string& name(Node node) const { return names_[node]; }
  const std::vector<Site>& sites() const { return sites_; }
  void mark_shifting(std::size_t site) { sites_[site].shifts = true; }
  /// Inputs held at a value while a test captures (test mode, scan enable): -1 free, else 0 or 1; by input
  /// order.
  const std::vector<std::int8_t>& held() const { return held_; }

 private:
  friend class CircuitBuilder;
  std::vector<Gate> kinds_;
  std::vector<std::uint32_t> fanin_begin_, fanout_begin_, level_;
  std::vector<Node> fanin_, fanout_, inputs_, outputs_;
  std::vector<std::string> names_;
  std::vector<Site> sites_;
  std::vector<std::int8_t> held_;
};

/// Value of every node when the inputs have these (by input; -1: any): 0, 1, or -1 where it depends on what
/// is free. Nodes that are marked in `open` (by node; empty: none) may have any value.
std::vector<std::int8_t> constants(const Circuit& circuit, const std::vector<std::int8_t>& inputs,
                                   const std::vector<std::uint8_t>& open = {});

/// Takes nodes in any order; finish() sorts them. Node numbers of the builder hold only inside it.
class CircuitBuilder {
 public:
  Node add(Gate kind, std::vector<Node> fanin, std::string name = "");
  /// The fan-in of a node that was added before its drivers were known.
  void set_fanin(Node node, std::vector<Node> fanin) { nodes_[node].fanin = std::move(fanin); }
  void add_site(Site site) { sites_.push_back(std::move(site)); }
  std::size_t site_count() const { return sites_.size(); }
  Site& site(std::size_t index) { return sites_[index]; }
  void hold(Node input, bool value) { held_.push_back({input, value}); }
  std::size_t size() const { return nodes_.size(); }
  std::span<const Node> fanin(Node node) const { return nodes_[node].fanin; }
  const std::string& name(Node node) const { return nodes_[node].name; }
  Gate kind(Node node) const { return nodes_[node].kind; }

  /// Throws UserError that names a node on a combinational loop. `source` stands in messages. `renumbered`,
  /// when given, tells the circuit's number of each of the builder's nodes.
  Circuit finish(const std::string& source, std::vector<Node>* renumbered = nullptr);

 private:
  struct Draft {
    Gate kind;
    std::vector<Node> fanin;
    std::string name;
  };
  struct Held {
    Node input;
    bool value;
  };
  std::vector<Draft> nodes_;
  std::vector<Site> sites_;
  std::vector<Held> held_;
};

}  // namespace meltstage::dft
