// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "asic/dft/scan/drivers.hpp"
#include "asic/dft/scan/scan_cells.hpp"
#include "asic/dft/scan/scan_ways.hpp"
#include "base/error.hpp"

namespace meltstage::dft {

namespace {

using Op = Expression::Op;

// "u_a.q_reg[10]" after "u_a.q_reg[9]": runs of digits compare as numbers.
bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0, k = 0;
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  while (i < a.size() && k < b.size()) {
    if (digit(a[i]) && digit(b[k])) {
      std::size_t ie = i, ke = k;
      while (ie < a.size() && digit(a[ie])) ++ie;
      while (ke < b.size() && digit(b[ke])) ++ke;
      while (i < ie && a[i] == '0') ++i;
      while (k < ke && b[k] == '0') ++k;
      if (ie - i != ke - k) return ie - i < ke - k;
      for (; i < ie; ++i, ++k) {
        if (a[i] != b[k]) return a[i] < b[k];
      }
    } else {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i;
      ++k;
    }
  }
  return a.size() - i < b.size() - k || (a.size() - i == b.size() - k && a < b);
}

class Inserter {
 public:
  Inserter(const Netlist& netlist, const CellLibrary& library, const ScanOptions& options)
      : library_(library), options_(options), drivers_(netlist, library) {
    design_.netlist = netlist;
    design_.test_mode = options.test_mode;
    design_.scan_enable = options.scan_enable;
  }

  ScanDesign run() {
    Netlist& netlist = design_.netlist;
    collect_flops();
    const Port* had_in = port_of_netlist(options_.scan_in, true);
    const Port* had_out = port_of_netlist(options_.scan_out, false);
    if (had_in != nullptr && had_out != nullptr && had_in->bits.size() != had_out->bits.size())
      throw UserError(fmt::format("{}: found {} of {} bits and {} of {}, expected one width", netlist.file,
                                  had_in->name, had_in->bits.size(), had_out->name, had_out->bits.size()));
    const std::size_t width = had_in != nullptr    ? had_in->bits.size()
                              : had_out != nullptr ? had_out->bits.size()
                                                   : std::max<std::size_t>(options_.chains, 1);
    const bool given = had_in != nullptr || had_out != nullptr;  // its width stays
    const std::size_t chains = std::min(width, flops_.size());
    const Net mode = input_port(options_.test_mode, 1).front();
    const Net enable = input_port(options_.scan_enable, 1).front();
    bypass_resets(mode);
    open_clock_gates(enable);
    const std::set<std::size_t> linked = put_in_order();
    const std::vector<Net> in = input_port(options_.scan_in, given ? width : chains);
    std::vector<Net> out;
    std::size_t at = 0;
    for (std::size_t c = 0; c < chains; ++c) {
      const std::size_t length = flops_.size() / chains + (c < flops_.size() % chains ? 1 : 0);
      ScanChain chain{fmt::format("chain{}", c),
                      bit_of(options_.scan_in, c, in.size()),
                      bit_of(options_.scan_out, c, in.size()),
                      {}};
      Net from = in[c];
      for (std::size_t k = 0; k < length; ++k) {
        const std::size_t flop = flops_[at++];
        chain.cells.push_back(netlist.instances[flop].name);
        if (k == 0 || linked.count(flop) == 0) lead_in(flop, from, enable);
        from = state_of(flop);
      }
      out.push_back(buffered(fmt::format("dft_scan_out{}", c), from, chain.out));
      design_.chains.push_back(std::move(chain));
    }
    out.resize(in.size(), 0);  // of a given port more bits than flops
    connect_scan_out(out);
    return std::move(design_);
  }

 private:
  static std::string bit_of(const std::string& port, std::size_t i, std::size_t width) {
    return width == 1 ? port : fmt::format("{}[{}]", port, i);
  }
  [[noreturn]] void fail(const Instance& instance, const std::string& text) const {
    throw UserError(fmt::format("{}: cell {}: {}", design_.netlist.file, instance.name, text));
  }

  // A test port that the netlist has already; nullptr when it hasn't.
  const Port* port_of_netlist(const std::string& name, bool input) const {
    for (const Port& port : design_.netlist.ports) {
      if (port.name != name) continue;
      if (port.is_input != input)
        throw UserError(fmt::format("{}: found {} port {}, expected an {}; name the test ports otherwise",
                                    design_.netlist.file, input ? "output" : "input", name,
                                    input ? "input" : "output"));
      return &port;
    }
    return nullptr;
  }
  // Bits of an input port, which is added when the netlist has none of the name.
  std::vector<Net> input_port(const std::string& name, std::size_t width) {
    const Port* had = port_of_netlist(name, true);
    if (had == nullptr) return add_port(name, true, width);
    if (had->bits.size() != width)
      throw UserError(fmt::format("{}: found port {} of {} bits, expected {}", design_.netlist.file, name,
                                  had->bits.size(), width));
    return had->bits;
  }
  // A cell without an input, or with constants on all of them: a tie cell, a buffer of a constant.
  static bool computes_a_constant(const Instance& instance) {
    return std::count_if(instance.pins.begin(), instance.pins.end(),
                         [](const auto& pin) { return pin.second > 1; }) == 1;
  }
  // A scan-out port that is there must be a constant so far.
  void connect_scan_out(const std::vector<Net>& out) {
    for (Port& port : design_.netlist.ports) {
      if (port.name != options_.scan_out) continue;
      for (std::size_t i = 0; i < port.bits.size(); ++i) {
        const auto driver = drivers_.driver_of(port.bits[i]);
        const bool tied = driver && computes_a_constant(design_.netlist.instances[*driver]);
        if (port.bits[i] > 1 && !tied)
          throw UserError(fmt::format("{}: found logic that drives {}, expected a constant before scan",
                                      design_.netlist.file, port.bit_name(i)));
      }
      port.bits = out;
      return;
    }
    design_.netlist.ports.push_back({options_.scan_out, false, out});
  }

  void collect_flops() {
    const Netlist& netlist = design_.netlist;
    for (std::size_t i = 0; i < netlist.instances.size(); ++i) {
      const Instance& instance = netlist.instances[i];
      const Cell* cell = find_cell(library_, instance.type);
      if (cell == nullptr)
        fail(instance, fmt::format("found type {}, expected a cell of the library", instance.type));
      if (!cell->flop) continue;
      if (cell->scan) fail(instance, "found a scan flop, expected a netlist before scan");
      flops_.push_back(i);
      if (!cell->defect.empty())
        throw UserError(
            fmt::format("{}; {} uses {} as {}", cell->defect, netlist.file, instance.type, instance.name));
      const std::string clock_pin = only_pin(cell->flop->clocked_on);
      if (instance.pins.count(clock_pin) == 0)
        fail(instance, fmt::format("found nothing connected to {}, expected a clock", clock_pin));
      bool inverted = false;
      const std::string port = drivers_.port_of(instance.pins.at(clock_pin), &inverted);
      if (port.empty())
        fail(instance,
             "found a clock from logic, expected one from an input port through buffers and clock gates; "
             "bypass "
             "it in test mode");
      if (inverted != (cell->flop->clocked_on.op == Op::inv))
        fail(instance,
             "found a flop on the falling edge, expected the rising one; scan of both edges isn't built");
      if (design_.clock.empty()) design_.clock = port;
      if (port != design_.clock)
        fail(
            instance,
            fmt::format("found clock {}, expected {} as the flops before; scan of several clocks isn't built",
                        port, design_.clock));
    }
    if (flops_.empty())
      throw UserError(fmt::format("{}: found no flop, expected some to scan", netlist.file));
    std::sort(flops_.begin(), flops_.end(), [&](std::size_t a, std::size_t b) {
      return natural_less(netlist.instances[a].name, netlist.instances[b].name);
    });
  }

  std::vector<Net> add_port(const std::string& name, bool input, std::size_t width) {
    std::vector<Net> bits;
    for (std::size_t i = 0; i < width; ++i) {
      design_.netlist.net_names[design_.netlist.next_net] = bit_of(name, i, width);
      bits.push_back(design_.netlist.next_net++);
    }
    design_.netlist.ports.push_back({name, input, bits});
    return bits;
  }
  Net add_mux(const std::string& name, Net zero, Net one, Net select) {
    if (mux_.cell == nullptr) mux_ = find_mux(library_, design_.netlist.file);
    const Net out = design_.netlist.next_net++;
    design_.netlist.net_names[out] = name + "_y";
    design_.netlist.instances.push_back(
        {name,
         mux_.cell->name,
         {{mux_.zero, zero}, {mux_.one, one}, {mux_.select, select}, {mux_.out, out}}});
    return out;
  }

  // The port's load and its wire aren't those of the function that the last flop has; and its net keeps its
  // own name.
  Net buffered(const std::string& name, Net net, const std::string& port) {
    const auto buffer = find_buffer(library_);
    if (!buffer) return net;
    const Net out = design_.netlist.next_net++;
    design_.netlist.net_names[out] = port;
    design_.netlist.instances.push_back({name, buffer->cell->name, {{buffer->in, net}, {buffer->out, out}}});
    return out;
  }

  // In shift every clock gate is open.
  void open_clock_gates(Net enable) {
    for (Instance& instance : design_.netlist.instances) {
      const Cell& plain = *find_cell(library_, instance.type);
      if (!plain.gate) continue;
      const Cell* form = testable_form(library_, plain);
      if (form == nullptr)
        fail(instance,
             fmt::format("found {}, a clock gate without a test enable, and none with one in the library",
                         plain.name));
      if (form != &plain) {
        std::map<std::string, Net> pins;
        for (const auto& [from, to] : {std::pair(plain.gate->clock, form->gate->clock),
                                       std::pair(plain.gate->enable, form->gate->enable),
                                       std::pair(plain.gate->out, form->gate->out)}) {
          if (instance.pins.count(from) != 0) pins[to] = instance.pins.at(from);
        }
        instance.type = form->name;
        instance.pins = std::move(pins);
      }
      const auto [test, fresh] = instance.pins.emplace(form->gate->test, enable);
      if (!fresh && test->second != 0 && test->second != enable)
        fail(instance, fmt::format("found something at {} already, expected 0 or {}", form->gate->test,
                                   design_.scan_enable));
      test->second = enable;
    }
  }

  // In test mode every asynchronous reset comes from the reset port.
  void bypass_resets(Net mode) {
    struct Reset {
      std::string pin;
      bool low;
    };
    Netlist& netlist = design_.netlist;
    const auto resets_of = [&](std::size_t i) {
      std::vector<Reset> resets;
      const Flop& flop = *find_cell(library_, netlist.instances[i].type)->flop;
      for (const auto& reset : {flop.clear, flop.preset}) {
        if (reset) resets.push_back({only_pin(*reset), reset->op == Op::inv});
      }
      return resets;
    };
    std::map<Net, bool> from_logic;  // or from another port, by net: active low
    std::map<Net, std::pair<std::string, bool>> from_ports;
    for (const std::size_t i : flops_) {
      for (const Reset& reset : resets_of(i)) {
        if (reset.pin.empty()) fail(netlist.instances[i], "found a reset of several pins, expected one");
        if (netlist.instances[i].pins.count(reset.pin) == 0)
          fail(netlist.instances[i],
               fmt::format("found nothing connected to {}, expected a reset", reset.pin));
        const Net net = netlist.instances[i].pins.at(reset.pin);
        if (net == 0 || net == 1) continue;
        bool inverted = false;
        const std::string port = drivers_.port_of(net, &inverted);
        if (port.empty())
          from_logic[net] = reset.low;
        else
          from_ports[net] = {port, reset.low};
        if (!port.empty() && design_.reset.empty() && (options_.reset.empty() || options_.reset == port)) {
          design_.reset = port;
          design_.reset_low = reset.low != inverted;
        }
      }
    }
    for (const auto& [net, reset] : from_ports)
      if (!design_.reset.empty() && reset.first != design_.reset) from_logic[net] = reset.second;
    if (from_logic.empty()) return;
    if (design_.reset.empty())
      throw UserError(fmt::format(
          "{}: found resets from logic alone, expected an input port that resets a flop; name one that may "
          "reset all in test mode",
          netlist.file));
    for (auto at = from_logic.begin(); at != from_logic.end();) {
      bool inverted = false;
      const bool bypassed =
          bypass_of(netlist, library_, drivers_, at->first, design_.test_mode, &inverted) == design_.reset &&
          at->second == (design_.reset_low != inverted);
      at = bypassed ? from_logic.erase(at) : std::next(at);
    }
    Net reset = 1;
    for (const Port& port : netlist.ports) {
      for (std::size_t i = 0; i < port.bits.size(); ++i) {
        if (port.bit_name(i) == design_.reset) reset = port.bits[i];
      }
    }
    std::map<Net, Net> bypassed;
    for (const auto& [net, low] : from_logic) {
      if (low != design_.reset_low)
        throw UserError(
            fmt::format("{}: found resets of both senses, expected one; invert in the RTL", netlist.file));
      bypassed[net] = add_mux(fmt::format("dft_reset_bypass{}", bypassed.size()), net, reset, mode);
    }
    for (const std::size_t i : flops_) {
      for (const Reset& r : resets_of(i)) {
        Net& net = netlist.instances[i].pins.at(r.pin);
        if (const auto found = bypassed.find(net); found != bypassed.end()) net = found->second;
      }
    }
  }

  // Flops in the order of their names, those that take over another's state while shifting right behind that
  // one; returns these.
  std::set<std::size_t> put_in_order() {
    std::map<std::string, std::size_t> flop_of;
    for (const std::size_t flop : flops_) flop_of[design_.netlist.instances[flop].name] = flop;
    const std::map<std::string, std::string> from = shifted_from(design_.netlist, library_, options_);
    std::map<std::size_t, std::size_t> before, behind;
    const auto first_of_row = [&](std::size_t flop) {
      for (auto at = before.find(flop); at != before.end(); at = before.find(flop)) flop = at->second;
      return flop;
    };
    for (const std::size_t flop : flops_) {
      const auto way = from.find(design_.netlist.instances[flop].name);
      if (way == from.end()) continue;
      const std::size_t other = flop_of.at(way->second);
      const bool closes_a_ring = first_of_row(other) == flop;
      if (!closes_a_ring && behind.emplace(other, flop).second) before[flop] = other;
    }
    std::vector<std::size_t> order;
    std::set<std::size_t> linked;
    for (const std::size_t first : flops_) {
      if (before.count(first) != 0) continue;
      order.push_back(first);
      for (auto next = behind.find(first); next != behind.end(); next = behind.find(next->second)) {
        order.push_back(next->second);
        linked.insert(next->second);
      }
    }
    flops_ = std::move(order);
    return linked;
  }

  // What is shifted comes to the flop from here.
  void lead_in(std::size_t index, Net from, Net enable) {
    Netlist& netlist = design_.netlist;
    const Cell& plain = *find_cell(library_, netlist.instances[index].type);
    if (const Cell* scan = scan_form(library_, plain)) {
      netlist.instances[index].type = scan->name;
      netlist.instances[index].pins[scan->scan->in] = from;
      netlist.instances[index].pins[scan->scan->enable] = enable;
      if (scan->scan->enable_low)
        fail(netlist.instances[index], "found a scan cell with a low enable, expected a high one");
    } else {
      const std::string data = plain.flop->next_state.op == Op::pin ? plain.flop->next_state.pin : "";
      if (data.empty())
        fail(netlist.instances[index],
             fmt::format("found {}, a flop with logic inside and no scan form in the library; map without "
                         "enables (dfflegalize)",
                         plain.name));
      const Net functional = netlist.instances[index].pins.at(data);
      const Net shifted = add_mux("dft_scan_" + netlist.instances[index].name, functional, from, enable);
      netlist.instances[index].pins[data] = shifted;
    }
  }

  // The net with a flop's state.
  Net state_of(std::size_t index) {
    Netlist& netlist = design_.netlist;
    const Cell& cell = *find_cell(library_, netlist.instances[index].type);
    Instance& instance = netlist.instances[index];
    for (const CellPin& pin : cell.pins) {
      if (!pin.is_output || !pin.function ||
          !(pin.function->op == Op::pin && pin.function->pin == cell.flop->state))
        continue;
      if (instance.pins.count(pin.name) == 0) {
        netlist.net_names[netlist.next_net] = instance.name + "_q";
        instance.pins[pin.name] = netlist.next_net++;
      }
      return instance.pins.at(pin.name);
    }
    fail(instance, "found no output that is the state, expected one for the chain");
  }

  const CellLibrary& library_;
  const ScanOptions& options_;
  Drivers drivers_;
  ScanDesign design_;
  std::vector<std::size_t> flops_;
  MuxCell mux_{nullptr, "", "", "", ""};
};

}  // namespace

ScanDesign insert_scan(const Netlist& netlist, const CellLibrary& library, const ScanOptions& options) {
  return Inserter(netlist, library, options).run();
}

}  // namespace meltstage::dft
