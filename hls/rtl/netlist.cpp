// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/netlist.hpp"

#include <fmt/format.h>
#include <llvm/Support/JSON.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "base/file.hpp"

namespace meltstage::hls {
namespace {

namespace json = llvm::json;

// A net of one bit, by the number that Yosys gives it, or a constant.
using Bit = int;
constexpr Bit kZero = -1, kOne = -2, kX = -3, kZ = -4;

struct CellPort {
  std::string name;
  bool is_output;
  std::vector<Bit> bits;
};

struct Cell {
  std::string type;
  std::string place;
  std::vector<CellPort> ports;
  bool is_flop;
  const json::Object* parameters;

  const CellPort* port(std::string_view name) const {
    const auto found =
        std::find_if(ports.begin(), ports.end(), [&](const CellPort& p) { return p.name == name; });
    return found == ports.end() ? nullptr : &*found;
  }
};

// What gives a bit its value: an output of a cell, or an input pin.
struct Driver {
  const Cell* cell;  // nullptr: a pin
  std::size_t index;
  std::string place;
};

// Yosys leaves a backslash before a digit.
std::string name_of(const json::ObjectKey& key) { return llvm::StringRef(key.str()).ltrim('\\').str(); }

std::vector<Bit> bits_of(const json::Value* list) {
  std::vector<Bit> result;
  for (const json::Value& bit : *list->getAsArray()) {
    const auto number = bit.getAsInteger();
    const llvm::StringRef constant = number ? "" : *bit.getAsString();
    result.push_back(number            ? static_cast<Bit>(*number)
                     : constant == "0" ? kZero
                     : constant == "1" ? kOne
                     : constant == "z" ? kZ
                                       : kX);
  }
  return result;
}

// FILE:LINE of `src`, which is FILE:LINE.COLUMN-LINE.COLUMN|...; line 0 is none.
std::string place_of(const json::Object& owner) {
  const json::Object* attributes = owner.getObject("attributes");
  const auto src = attributes == nullptr ? llvm::None : attributes->getString("src");
  std::string fallback = "RTL";
  for (llvm::StringRef rest = src ? *src : ""; !rest.empty();) {
    const auto [one, others] = rest.split('|');
    rest = others;
    const auto [file, at] = one.rsplit(':');
    const llvm::StringRef line = at.split('.').first;
    if (line != "0") return fmt::format("{}:{}", file.str(), line.str());
    fallback = file.str();
  }
  return fallback;
}

bool is_high(const json::Object& parameters, const char* name) {
  const auto value = parameters.getString(name);
  return value && value->endswith("1");
}

constexpr std::string_view kBitwise[] = {"$not", "$pos", "$and", "$or", "$xor", "$xnor", "$mux", "$pmux"};
constexpr std::string_view kUpwards[] = {"$add", "$sub", "$neg"};  // a bit depends on those below
constexpr std::string_view kRisingFlops[] = {"$dff",    "$dffe", "$sdff", "$sdffe",
                                             "$sdffce", "$adff", "$adffe"};

template <std::size_t count>
bool is_one_of(const std::string& type, const std::string_view (&types)[count]) {
  return std::find(std::begin(types), std::end(types), type) != std::end(types);
}

class Reader {
 public:
  explicit Reader(const json::Object& module) {
    read_names(*module.getObject("netnames"));
    read_ports(*module.getObject("ports"));
    read_cells(*module.getObject("cells"));
  }

  Netlist run() {
    for (const Cell& cell : cells_)
      if (cell.is_flop) check_flop(cell);
    for (const Cell& cell : cells_) {
      if (!cell.is_flop || names_of_flop(cell).empty()) continue;
      for (const CellPort& port : cell.ports)
        if (!port.is_output && port.name != "CLK") follow(port, "flop " + names_of_flop(cell), cell.place);
    }
    for (const auto& [name, port] : outputs_) follow(port, "pin " + name, result_.ports.at(name).place);
    return std::move(result_);
  }

 private:
  // ---- reading -------------------------------------------------------------------------------------------

  void read_names(const json::Object& nets) {
    std::map<std::string, const json::Object*> sorted;  // the same names each time
    for (const auto& [name, net] : nets) sorted[name_of(name)] = net.getAsObject();
    for (const auto& [name, net] : sorted) {
      // names with a $ are Yosys' own
      if (name.find('$') != std::string::npos) continue;
      const std::vector<Bit> bits = bits_of(net->get("bits"));
      const auto from = net->getInteger("offset");
      for (std::size_t i = 0; i < bits.size(); ++i) {
        if (bits[i] < 0) continue;
        words_.emplace(bits[i], name);
        const std::string bit =
            bits.size() == 1 ? name
                             : fmt::format("{}[{}]", name, static_cast<std::int64_t>(i) + from.getValueOr(0));
        nets_.try_emplace(bits[i], Net{name, bit, place_of(*net)});
      }
    }
  }

  void read_ports(const json::Object& ports) {
    for (const auto& [key, value] : ports) {
      const std::string name = name_of(key);
      const json::Object& port = *value.getAsObject();
      const llvm::StringRef direction = *port.getString("direction");
      const std::vector<Bit> bits = bits_of(port.get("bits"));
      const std::string place = port_place(name);
      if (direction == "inout")
        throw UserError(fmt::format("{}: found inout {}, expected pins of one direction", place, name));
      result_.ports[name] = {direction == "input", static_cast<unsigned>(bits.size()), place};
      if (direction == "output") {
        outputs_[name] = {name, true, bits};
        continue;
      }
      if (name == kClock && bits.size() == 1) clock_ = bits[0];
      for (std::size_t i = 0; i < bits.size(); ++i)
        drive(bits[i],
              {nullptr, i, fmt::format("pin {}", bits.size() == 1 ? name : fmt::format("{}[{}]", name, i))},
              place);
    }
  }

  void read_cells(const json::Object& cells) {
    std::map<std::string, const json::Object*> sorted;
    for (const auto& [name, cell] : cells) sorted[name.str()] = cell.getAsObject();
    cells_.reserve(sorted.size());
    for (const auto& [name, value] : sorted) {
      Cell cell{.type = value->getString("type")->str(),
                .place = place_of(*value),
                .ports = {},
                .is_flop = false,
                .parameters = value->getObject("parameters")};
      cell.is_flop = cell.type.find("dff") != std::string::npos ||
                     cell.type.find("latch") != std::string::npos || cell.type == "$sr" || cell.type == "$ff";
      const json::Object& directions = *value->getObject("port_directions");
      for (const auto& [port, bits] : *value->getObject("connections"))
        cell.ports.push_back(
            {port.str(), directions.getString(port) == llvm::StringRef("output"), bits_of(&bits)});
      // what Yosys makes of a whole always block has no line, but the net has
      for (const CellPort& port : cell.ports)
        if (port.is_output && cell.place.find(':') == std::string::npos)
          cell.place = place_of_net(port.bits[0], cell.place);
      cells_.push_back(std::move(cell));
    }
    for (const Cell& cell : cells_)
      for (const CellPort& port : cell.ports)
        for (std::size_t i = 0; port.is_output && i < port.bits.size(); ++i)
          drive(port.bits[i], {&cell, i, cell.place}, cell.place);
  }

  void drive(Bit bit, Driver driver, const std::string& place) {
    if (bit < 0)
      throw UserError(fmt::format("{}: found {} on a net that is a constant, too, expected one driver", place,
                                  driver.cell == nullptr ? driver.place : "a result"));
    const auto [known, is_new] = drivers_.try_emplace(bit, driver);
    if (is_new) return;
    const std::string name = names_of({bit});
    throw UserError(fmt::format("{}: found two drivers of {}, {} and {}, expected one",
                                driver.cell == nullptr ? place : place_of_net(bit, place),
                                name.empty() ? "a net" : name, known->second.place, driver.place));
  }

  std::string port_place(const std::string& name) const {
    for (const auto& [bit, net] : nets_)
      if (net.word == name) return net.place;
    return "RTL";
  }

  // ---- names ---------------------------------------------------------------------------------------------

  struct Net {
    std::string word;
    std::string bit;
    std::string place;
  };

  std::string place_of_net(Bit bit, const std::string& otherwise) const {
    const auto net = nets_.find(bit);
    return net == nets_.end() ? otherwise : net->second.place;
  }

  // Names of the first few of these bits that have one.
  std::string names_of(const std::vector<Bit>& bits) const {
    std::vector<std::string> names;
    for (const Bit bit : bits)
      if (const auto net = nets_.find(bit); net != nets_.end() && names.size() < 4)
        names.push_back(net->second.bit);
    return fmt::format("{}", fmt::join(names, ", "));
  }

  // Empty for those that Yosys makes of variables of functions and blocks.
  std::string names_of_flop(const Cell& cell) const {
    for (const Bit bit : cell.port("Q")->bits)
      if (const auto net = nets_.find(bit); net != nets_.end()) return net->second.word;
    return "";
  }

  // ---- flops ---------------------------------------------------------------------------------------------

  void check_flop(const Cell& cell) {
    const std::string own = names_of_flop(cell);
    if (own.empty()) return;
    const auto [first, last] = words_.equal_range(cell.port("Q")->bits[0]);
    for (auto word = first; word != last; ++word) result_.flop_places[word->second] = cell.place;
    if (!is_one_of(cell.type, kRisingFlops)) {
      throw UserError(
          cell.type.find("latch") != std::string::npos || cell.type == "$sr"
              ? fmt::format("{}: found a latch, {}, expected flops of {} only", cell.place, own, kClock)
              : fmt::format("{}: found flop {} with a set and a reset or one to a value that is no "
                            "constant, expected one asynchronous reset to a constant",
                            cell.place, own));
    }
    if (!is_high(*cell.parameters, "CLK_POLARITY"))
      throw UserError(fmt::format("{}: found flop {} at a falling edge, expected the rising edge of {}",
                                  cell.place, own, kClock));
    if (!clock_)
      throw UserError(fmt::format("{}: found flop {} and no pin {}, expected the clock under this name",
                                  cell.place, own, kClock));
    if (const Bit clock = cell.port("CLK")->bits[0]; clock != *clock_) {
      const std::string name = names_of({clock});
      throw UserError(fmt::format("{}: found flop {} clocked by {}, expected {} itself", cell.place, own,
                                  name.empty() ? "a function of pins or flops" : name, kClock));
    }
    const CellPort* reset = cell.port("ARST");
    const std::string by = reset == nullptr ? "" : reset_source(reset->bits[0], cell, own);
    if (reset != nullptr &&
        cell.parameters->getString("ARST_VALUE")->find_first_not_of("01") != llvm::StringRef::npos)
      throw UserError(fmt::format("{}: found flop {} reset to x, expected 0 or 1", cell.place, own));
    result_.reset_by[by] += cell.port("Q")->bits.size();
  }

  // What resets a flop at once.
  std::string reset_source(Bit bit, const Cell& flop, const std::string& own) {
    if (bit == kZero || bit == kOne) return "";
    const std::vector<std::string> sources = pins_and_flops_behind(bit);
    const std::string by = fmt::format("{}", fmt::join(sources, " and "));
    if (sources.size() > 1 && result_.mixed_reset.empty())
      result_.mixed_reset = fmt::format("{}: found flop {} reset at once by {}", flop.place, own, by);
    return by;
  }

  std::vector<std::string> pins_and_flops_behind(Bit root) const {
    std::set<std::string> names;
    std::set<Bit> seen;
    for (std::vector<Bit> open = {root}; !open.empty();) {
      const Bit bit = open.back();
      open.pop_back();
      if (bit < 0 || !seen.insert(bit).second) continue;
      const auto driver = drivers_.find(bit);
      if (driver == drivers_.end() || driver->second.cell == nullptr || driver->second.cell->is_flop) {
        names.insert(names_of({bit}));
      } else {
        const std::vector<Bit> needs = needs_of(*driver->second.cell, driver->second.index);
        open.insert(open.end(), needs.begin(), needs.end());
      }
    }
    return {names.begin(), names.end()};
  }

  // The cell that gives a bit; none for pins.
  const Cell* gate_at(Bit bit) const {
    const auto driver = drivers_.find(bit);
    return driver == drivers_.end() ? nullptr : driver->second.cell;
  }

  // ---- what flops and pins depend on ---------------------------------------------------------------------

  // Nodes are bits, and cells below 0: -1 - CELL.
  struct Step {
    int node;
    std::vector<Bit> needs;
    std::size_t next = 0;
  };

  void follow(const CellPort& root, const std::string& name, const std::string& place) {
    for (const Bit bit : root.bits) {
      std::vector<Step> path;
      enter(path, bit, name, place);
      while (!path.empty()) {
        Step& last = path.back();
        if (last.next < last.needs.size()) {
          enter(path, last.needs[last.next++], name, place);
        } else {
          on_path_.erase(last.node);
          path.pop_back();
        }
      }
    }
  }

  void enter(std::vector<Step>& path, Bit bit, const std::string& root, const std::string& place) {
    const std::string at = place_of_last(path, place);
    if (bit == kZ) throw UserError(fmt::format("{}: found a z, expected 0 or 1; {} depends on it", at, root));
    if (bit < 0) return;  // 0 and 1, and x, which is any value
    if (on_path_.contains(bit)) refuse_loop(path, bit, root, at);
    if (!seen_.insert(bit).second) return;
    if (bit == clock_)
      throw UserError(fmt::format("{}: found {} as data, expected it as a clock alone; {} depends on it", at,
                                  kClock, root));
    const auto driver = drivers_.find(bit);
    if (driver == drivers_.end()) {
      const std::string net = names_of({bit});
      if (net.empty()) return;  // of the words that a memory has not, which Yosys reads all the same
      throw UserError(fmt::format("{}: found no driver of {}, expected one; {} depends on it",
                                  place_of_net(bit, at), net, root));
    }
    if (driver->second.cell == nullptr || driver->second.cell->is_flop) return;
    path.push_back({bit, needs_of(*driver->second.cell, driver->second.index)});
    on_path_.insert(bit);
  }

  std::string place_of_last(const std::vector<Step>& path, const std::string& otherwise) const {
    return path.empty() ? otherwise : gate_at(path.back().node)->place;
  }

  [[noreturn]] void refuse_loop(const std::vector<Step>& path, Bit bit, const std::string& root,
                                const std::string& place) const {
    std::vector<Bit> loop;
    for (auto step = path.rbegin(); step != path.rend(); ++step) {
      loop.push_back(step->node);
      if (step->node == bit) break;
    }
    const std::string names = names_of(loop);
    throw UserError(fmt::format("{}: found a loop without a flop{}, expected none; {} depends on it", place,
                                names.empty() ? "" : " through " + names, root));
  }

  std::vector<Bit> needs_of(const Cell& cell, std::size_t index) const {
    std::vector<Bit> result;
    const bool bitwise = is_one_of(cell.type, kBitwise), upwards = is_one_of(cell.type, kUpwards);
    const std::size_t width = cell.port("Y") == nullptr ? 1 : cell.port("Y")->bits.size();
    for (const CellPort& port : cell.ports) {
      if (port.is_output) continue;
      if (port.bits.empty()) continue;
      if (upwards) {
        const std::size_t last = std::min(index, port.bits.size() - 1);
        result.insert(result.end(), port.bits.begin(),
                      port.bits.begin() + static_cast<std::ptrdiff_t>(last) + 1);
      } else if (bitwise && port.name != "S") {
        // several words side by side ($pmux), or one whose sign is repeated
        for (std::size_t i = std::min(index, port.bits.size() - 1); i < port.bits.size(); i += width)
          result.push_back(port.bits[i]);
      } else {
        result.insert(result.end(), port.bits.begin(), port.bits.end());
      }
    }
    return result;
  }

  static constexpr const char* kClock = "clk_i";

  std::map<Bit, Net> nets_;
  std::multimap<Bit, std::string> words_;  // all that have the bit
  std::map<std::string, CellPort> outputs_;
  std::vector<Cell> cells_;
  std::map<Bit, Driver> drivers_;
  std::optional<Bit> clock_;
  std::set<Bit> seen_;
  std::set<Bit> on_path_;
  Netlist result_;
};

}  // namespace

Netlist read_netlist(const std::filesystem::path& path, const std::string& top) {
  auto whole = json::parse(read_file(path, "what Yosys read"));
  if (!whole) throw UserError(fmt::format("RTL: {}", llvm::toString(whole.takeError())));
  const json::Object* modules = whole->getAsObject()->getObject("modules");
  const json::Object* module = modules == nullptr ? nullptr : modules->getObject(top);
  if (module == nullptr) throw UserError(fmt::format("RTL: found no module {}", top));
  return Reader(*module).run();
}

}  // namespace meltstage::hls
