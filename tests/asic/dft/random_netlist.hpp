// SPDX-License-Identifier: Apache-2.0
// Small netlists that no one drew: redundant logic, flops with and without reset, shift registers, tied pins,
// clocks and resets through buffers, a reset that logic drives, logic that reads the test pins.
#pragma once

#include <array>
#include <random>
#include <string>
#include <vector>

#include "asic/netlist/netlist.hpp"

namespace meltstage::dft {

class RandomNetlist {
 public:
  /// Of mini.lib's cells, or of Yosys' own gates.
  RandomNetlist(std::uint64_t seed, bool of_mini) : random_(seed), mini_(of_mini) {}

  Netlist make(std::size_t flops, std::size_t gates) {
    netlist_.file = "random.json";
    netlist_.top = "random";
    const std::size_t inputs = 2 + draw(3);
    for (std::size_t i = 0; i < inputs; ++i) signals_.push_back(port("in" + std::to_string(i)));
    if (flops != 0) add_clock_and_reset();
    for (std::size_t i = 0; i < flops; ++i) signals_.push_back(netlist_.next_net++);  // states
    const std::size_t states = inputs;
    if (flops != 0 && draw(3) == 0) signals_.push_back(port("scan_en_i"));  // logic that test pins steer
    if (flops != 0 && draw(4) == 0) signals_.push_back(port("test_mode_i"));
    for (std::size_t i = 0; i < gates; ++i) add_gate();
    for (std::size_t i = 0; i < flops; ++i) add_flop(i, signals_[states + i]);
    const std::size_t outputs = 1 + draw(3);
    for (std::size_t i = 0; i < outputs; ++i)
      netlist_.ports.push_back({"out" + std::to_string(i), false, {signals_[signals_.size() - 1 - draw(6)]}});
    return std::move(netlist_);
  }

 private:
  std::size_t draw(std::size_t below) { return random_() % below; }
  Net port(const std::string& name) {
    netlist_.ports.push_back({name, true, {netlist_.next_net}});
    return netlist_.next_net++;
  }
  Net cell(const std::string& type, std::map<std::string, Net> pins) {
    pins["Y"] = netlist_.next_net;
    netlist_.instances.push_back({"g" + std::to_string(netlist_.instances.size()), type, std::move(pins)});
    return netlist_.next_net++;
  }
  Net wire(Net from, bool inverting) {
    return cell(inverting ? (mini_ ? "INV" : "$_NOT_") : (mini_ ? "BUF" : "$_BUF_"), {{"A", from}});
  }
  Net signal() { return draw(20) == 0 ? static_cast<Net>(draw(2)) : signals_[draw(signals_.size())]; }

  void add_clock_and_reset() {
    const Net clock = port("clk_i");
    clocks_ = {clock};
    if (draw(2) == 0) clocks_.push_back(wire(clock, false));
    if (draw(3) == 0) clocks_.push_back(wire(wire(clock, true), true));
    if (draw(4) == 0) return;  // no reset at all
    const Net reset = port("rst_ni");
    resets_ = {reset};
    if (draw(2) == 0) resets_.push_back(wire(reset, false));
    if (draw(3) == 0) resets_.push_back(wire(wire(reset, true), true));
  }
  void add_gate() {
    static const std::array<const char*, 5> kMini{"AND2", "NAND2", "OR2", "NOR2", "XOR2"},
        kYosys{"$_AND_", "$_NAND_", "$_OR_", "$_NOR_", "$_XOR_"};
    const std::size_t kind = draw(8);
    if (kind < 5)
      signals_.push_back(cell(mini_ ? kMini[kind] : kYosys[kind], {{"A", signal()}, {"B", signal()}}));
    else if (kind == 5)
      signals_.push_back(
          cell(mini_ ? "MUX2" : "$_MUX_", {{"A", signal()}, {"B", signal()}, {"S", signal()}}));
    else if (kind == 6)
      signals_.push_back(
          cell(mini_ ? "AOI21" : "$_AOI3_", {{"A", signal()}, {"B", signal()}, {"C", signal()}}));
    else
      signals_.push_back(wire(signal(), draw(2) == 0));
  }
  void add_flop(std::size_t i, Net state) {
    const std::size_t kind = resets_.empty() ? 0 : draw(3);
    std::map<std::string, Net> pins{
        {"D", signal()}, {mini_ ? "CK" : "C", clocks_[draw(clocks_.size())]}, {"Q", state}};
    if (kind != 0) {
      Net reset = resets_[draw(resets_.size())];
      const bool of_logic = draw(8) == 0 && has_reset_from_port_;
      if (of_logic)
        reset = cell(mini_ ? "AND2" : "$_AND_", {{"A", reset}, {"B", signals_[draw(signals_.size())]}});
      has_reset_from_port_ = true;
      pins[!mini_ ? "R" : kind == 1 ? "RN" : "SN"] = reset;
    }
    const char* mini[] = {"DFF", "DFFR", "DFFS"};
    const char* yosys[] = {"$_DFF_P_", "$_DFF_PN0_", "$_DFF_PN1_"};
    netlist_.instances.push_back(
        {"q" + std::to_string(i), mini_ ? mini[kind] : yosys[kind], std::move(pins)});
  }

  std::mt19937_64 random_;
  bool mini_;
  bool has_reset_from_port_ = false;
  Netlist netlist_;
  std::vector<Net> signals_, clocks_, resets_;
};

}  // namespace meltstage::dft
