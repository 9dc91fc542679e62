// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/rtl.hpp"

#include <fmt/format.h>

#include <cctype>
#include <regex>
#include <sstream>
#include <string_view>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/temporary_folder.hpp"
#include "hls/rtl/array_indices.hpp"
#include "hls/rtl/memory_words.hpp"
#include "hls/rtl/other_readings.hpp"
#include "hls/rtl/selects.hpp"
#include "hls/subprocess.hpp"

namespace meltstage::hls {
namespace {

// Cells in whose place Yosys puts inputs and outputs of the top (expose -evert). Their names are kept, the
// flops' names are those of the wires at Q.
constexpr const char* kCuts = R"((* blackbox *) module hls_flop (input D, C, R, V, output Q); endmodule
(* blackbox *) module hls_product (input [63:0] A, B, output [63:0] Y); endmodule
(* blackbox *) module hls_open (output Y); endmodule
)";

constexpr const char* kFlops = R"(
module \$_DFF_P_ (input D, C, output Q);
  hls_flop f (.D(D), .C(C), .R(1'b0), .V(1'b0), .Q(Q));
endmodule
module \$_DFF_PN0_ (input D, C, R, output Q);
  hls_flop f (.D(D), .C(C), .R(~R), .V(1'b0), .Q(Q));
endmodule
module \$_DFF_PN1_ (input D, C, R, output Q);
  hls_flop f (.D(D), .C(C), .R(~R), .V(1'b1), .Q(Q));
endmodule
module \$_DFF_PP0_ (input D, C, R, output Q);
  hls_flop f (.D(D), .C(C), .R(R), .V(1'b0), .Q(Q));
endmodule
module \$_DFF_PP1_ (input D, C, R, output Q);
  hls_flop f (.D(D), .C(C), .R(R), .V(1'b1), .Q(Q));
endmodule
)";

constexpr const char* kProducts = R"(
(* techmap_celltype = "$mul" *)
module hls_cut_product (A, B, Y);
  parameter A_SIGNED = 0;
  parameter B_SIGNED = 0;
  parameter A_WIDTH = 1;
  parameter B_WIDTH = 1;
  parameter Y_WIDTH = 1;
  parameter [A_WIDTH-1:0] _TECHMAP_CONSTMSK_A_ = 0;
  parameter [B_WIDTH-1:0] _TECHMAP_CONSTMSK_B_ = 0;
  input [A_WIDTH-1:0] A;
  input [B_WIDTH-1:0] B;
  output [Y_WIDTH-1:0] Y;
  wire _TECHMAP_FAIL_ = &_TECHMAP_CONSTMSK_A_ || &_TECHMAP_CONSTMSK_B_ || Y_WIDTH > 64;
  wire [63:0] a, b, y;
  generate
    if (A_SIGNED && B_SIGNED) begin
      assign a = $signed(A);
      assign b = $signed(B);
    end else begin
      assign a = A;
      assign b = B;
    end
  endgenerate
  hls_product product (.A(a), .B(b), .Y(y));
  assign Y = y[Y_WIDTH-1:0];
endmodule
)";

// Yosys has a value of its own for a quotient by 0, which IEEE 1800 leaves unknown.
std::string quotient_by_zero(std::string_view cell) {
  return fmt::format(R"(
(* techmap_celltype = "${0}" *)
module hls_{0} (A, B, Y);
  parameter A_SIGNED = 0;
  parameter B_SIGNED = 0;
  parameter A_WIDTH = 1;
  parameter B_WIDTH = 1;
  parameter Y_WIDTH = 1;
  input [A_WIDTH-1:0] A;
  input [B_WIDTH-1:0] B;
  output [Y_WIDTH-1:0] Y;
  wire [Y_WIDTH-1:0] y;
  \${0} #(.A_SIGNED(A_SIGNED), .B_SIGNED(B_SIGNED), .A_WIDTH(A_WIDTH), .B_WIDTH(B_WIDTH), .Y_WIDTH(Y_WIDTH))
    _TECHMAP_REPLACE_ (.A(A), .B(B), .Y(y));
  assign Y = |B ? y : {{Y_WIDTH{{1'bx}}}};
endmodule
)",
                     cell);
}

// An x, and what no net drives, is any value: an input of its own, a bit each.
constexpr const char* kOpen = R"(
(* techmap_celltype = "$anyseq" *)
module hls_cut_open (Y);
  parameter WIDTH = 1;
  output [WIDTH-1:0] Y;
  genvar i;
  generate
    for (i = 0; i < WIDTH; i = i + 1) begin : bits
      hls_open value (.Y(Y[i]));
    end
  endgenerate
endmodule
)";

std::string quoted(const std::filesystem::path& path) { return fmt::format("\"{}\"", path.string()); }

std::string files_of(const RtlSources& sources) {
  std::string files;
  for (const auto& include : sources.include_folders) files += " -I" + include.string();
  for (const auto& file : sources.files) files += ' ' + quoted(std::filesystem::absolute(file));
  return files;
}

// Reads arrays as they are written, of which script() makes flops where a reset sets them.
std::string script_of_arrays(const RtlSources& sources, const TemporaryFolder& folder) {
  return fmt::format("read_verilog -sv -DSYNTHESIS -nomem2reg{}\nhierarchy -top {}\nwrite_rtlil {}\n",
                     files_of(sources), sources.top, quoted(folder.path() / "arrays.il"));
}

// What is written, without processes and instances.
std::string script_of_rtl(const RtlSources& sources, const TemporaryFolder& folder) {
  return fmt::format(R"(read_verilog -sv -DSYNTHESIS{files}
hierarchy -check -top {top}
write_rtlil {modules}
proc
chformal -remove
select -assert-none t:$anyconst t:$anyseq t:$allconst t:$allseq
setattr -unset src c:* t:$* %d
flatten
write_rtlil {rtl}
memory_map
write_json {netlist}
)",
                     fmt::arg("files", files_of(sources)), fmt::arg("top", sources.top),
                     fmt::arg("modules", quoted(folder.path() / "modules.il")),
                     fmt::arg("rtl", quoted(folder.path() / "rtl.il")),
                     fmt::arg("netlist", quoted(folder.path() / "netlist.json")));
}

std::string script_of_gates(const std::string& top, const TemporaryFolder& folder) {
  return fmt::format(
      R"(read_verilog -lib {cuts}
read_verilog {words}
read_rtlil {bounded}
hierarchy -top {top}
flatten
techmap -max_iter 1 -map {quotients}
memory_map
setundef -anyseq
select -set flops t:$*dff* %co1:+[Q]
select -set flops w:* w:*$* %d @flops %i
setattr -set keep 1 @flops
opt_clean -purge
opt_expr
dffunmap
techmap -map {products}
simplemap t:$dff t:$adff t:$dlatch
techmap -map {flops} t:$_DFF*
opt_clean -purge
select -assert-none t:*LATCH* t:*DFF* t:*dff*
techmap
setundef -undriven -anyseq
techmap -map {open} t:$anyseq
rename -enumerate -pattern hls_product% t:hls_product
rename -enumerate -pattern hls_flop% t:hls_flop
rename -enumerate -pattern hls_open% t:hls_open
expose -evert @flops t:hls_product t:hls_flop t:hls_open
delete =hls_product =hls_flop =hls_open
aigmap
write_aiger -symbols {gates}
)",
      fmt::arg("cuts", quoted(folder.path() / "cuts.v")),
      fmt::arg("words", quoted(folder.path() / "words.v")),
      fmt::arg("bounded", quoted(folder.path() / "bounded.il")), fmt::arg("top", top),
      fmt::arg("quotients", quoted(folder.path() / "quotients.v")),
      fmt::arg("products", quoted(folder.path() / "products.v")),
      fmt::arg("flops", quoted(folder.path() / "flops.v")),
      fmt::arg("open", quoted(folder.path() / "open.v")),
      fmt::arg("gates", quoted(folder.path() / "gates.aig")));
}

constexpr std::string_view kOpenValue = "hls_open";

// A port of a cut cell: hls_flop7.D, hls_product0.A[12].
struct CutPort {
  bool is_flop;
  std::size_t cell;
  char port;
  std::size_t bit;
};

bool read_number(std::string_view& text, std::size_t& number) {
  std::size_t digits = 0;
  for (number = 0; digits < text.size() && std::isdigit(static_cast<unsigned char>(text[digits])) != 0;
       ++digits)
    number = 10 * number + static_cast<std::size_t>(text[digits] - '0');
  text.remove_prefix(digits);
  return digits > 0 && digits < 10;
}

bool read_cut_port(std::string_view name, CutPort& port) {
  constexpr std::string_view kFlop = "hls_flop", kProduct = "hls_product";
  port.is_flop = name.starts_with(kFlop);
  if (!port.is_flop && !name.starts_with(kProduct)) return false;
  name.remove_prefix(port.is_flop ? kFlop.size() : kProduct.size());
  if (!read_number(name, port.cell) || name.size() < 2 || name[0] != '.') return false;
  port.port = name[1];
  name.remove_prefix(2);
  port.bit = 0;
  if (name.starts_with('[')) {
    name.remove_prefix(1);
    if (!read_number(name, port.bit)) return false;
  }
  return true;
}

// Yosys leaves one before a digit.
std::string without_backslash(const std::string& name) { return name.substr(name.starts_with('\\') ? 1 : 0); }

// Sorts the ports of the cut gates to flops, products and pins.
class Sorter {
 public:
  Sorter(AigerFile gates, Rtl rtl) : rtl_(std::move(rtl)) {
    rtl_.gates = std::move(gates);
    for (std::string& name : rtl_.gates.inputs) name = without_backslash(name);
    for (AigerFile::Output& output : rtl_.gates.outputs) output.name = without_backslash(output.name);
  }

  Rtl run() {
    for (std::size_t i = 0; i < rtl_.gates.inputs.size(); ++i)
      take(rtl_.gates.inputs[i], static_cast<std::uint32_t>(2 * (i + 1)), rtl_.inputs);
    std::unordered_map<std::uint32_t, std::size_t> flop_of;  // by its literal
    for (std::size_t i = 0; i < rtl_.flops.size(); ++i) flop_of[rtl_.flops[i].now] = i;
    for (const AigerFile::Output& output : rtl_.gates.outputs) take(output.name, output.value, rtl_.outputs);
    // A wire at a flop's output is its name; the others are pins.
    for (const AigerFile::Output& output : rtl_.gates.outputs) {
      const auto flop = flop_of.find(output.value);
      CutPort port{};
      if (flop == flop_of.end() || read_cut_port(output.name, port)) continue;
      rtl_.flops[flop->second].names.push_back(output.name);
    }
    for (const RtlFlop& flop : rtl_.flops) check(flop);
    order_products();
    return std::move(rtl_);
  }

 private:
  void take(const std::string& name, std::uint32_t literal, std::map<std::string, std::uint32_t>& pins) {
    CutPort port{};
    if (!read_cut_port(name, port)) {
      pins[any_value(name)] = literal;
    } else if (port.is_flop) {
      if (rtl_.flops.size() <= port.cell) rtl_.flops.resize(port.cell + 1);
      RtlFlop& flop = rtl_.flops[port.cell];
      (port.port == 'Q'   ? flop.now
       : port.port == 'D' ? flop.next
       : port.port == 'C' ? flop.clock
       : port.port == 'R' ? flop.in_reset
                          : flop.reset_value) = literal;
    } else {
      if (rtl_.products.size() <= port.cell) rtl_.products.resize(port.cell + 1);
      RtlProduct& product = rtl_.products[port.cell];
      auto& bits = port.port == 'A' ? product.a : port.port == 'B' ? product.b : product.result;
      bits.resize(kProductBits);
      bits[port.bit] = literal;
    }
  }

  // hls_open7.Y as x#7, which is no name of a pin.
  static std::string any_value(const std::string& name) {
    std::string_view rest = name;
    std::size_t number = 0;
    if (!rest.starts_with(kOpenValue)) return name;
    rest.remove_prefix(kOpenValue.size());
    return read_number(rest, number) && rest == ".Y" ? fmt::format("x#{}", number) : name;
  }

  // Each product behind those that its operands rest on.
  void order_products() {
    std::unordered_map<std::uint32_t, std::size_t> product_of;  // by node
    for (std::size_t i = 0; i < rtl_.products.size(); ++i)
      for (const std::uint32_t bit : rtl_.products[i].result)
        if (bit != 0) product_of[bit / 2] = i;
    const std::size_t inputs = rtl_.gates.inputs.size();
    // operands' nodes that are still to be looked at, for each product that is begun
    struct Begun {
      std::size_t product;
      std::vector<std::uint32_t> open;
      std::vector<bool> seen;
    };
    const auto begin = [&](std::size_t product) {
      Begun begun{product, {}, std::vector<bool>(1 + inputs + rtl_.gates.ands.size())};
      for (const auto* operand : {&rtl_.products[product].a, &rtl_.products[product].b})
        for (const std::uint32_t bit : *operand) begun.open.push_back(bit / 2);
      return begun;
    };
    std::vector<RtlProduct> ordered;
    std::vector<bool> placed(rtl_.products.size());
    for (std::size_t i = 0; i < rtl_.products.size(); ++i) {
      std::vector<Begun> stack;
      if (!placed[i]) stack.push_back(begin(i));
      while (!stack.empty()) {
        Begun& top = stack.back();
        if (top.open.empty()) {
          ordered.push_back(rtl_.products[top.product]);
          placed[top.product] = true;
          stack.pop_back();
          continue;
        }
        const std::uint32_t node = top.open.back();
        const auto product = product_of.find(node);
        if (product != product_of.end() && !placed[product->second]) {
          stack.push_back(begin(product->second));  // the node is looked at again behind it
          continue;
        }
        top.open.pop_back();
        if (node <= inputs || top.seen[node]) continue;
        top.seen[node] = true;
        const Aig::And& gate = rtl_.gates.ands[node - inputs - 1];
        top.open.push_back(gate.a / 2);
        top.open.push_back(gate.b / 2);
      }
    }
    rtl_.products = std::move(ordered);
  }

  void check(const RtlFlop& flop) const {
    const auto clock = rtl_.inputs.find("clk_i");
    if (clock == rtl_.inputs.end())
      throw UserError("RTL: found no pin clk_i, expected the clock under this name");
    if (flop.clock != clock->second)
      throw UserError(
          fmt::format("RTL: {}: found another clock than clk_i, expected that one at its rising edge",
                      flop.names.empty() ? "a flop without a name" : flop.names.front()));
  }

  Rtl rtl_;
};

}  // namespace

RtlSources read_file_list(const std::filesystem::path& list, const std::string& top) {
  RtlSources sources{.files = {}, .include_folders = {}, .top = top};
  const std::filesystem::path folder = std::filesystem::absolute(list).parent_path();
  constexpr std::string_view kInclude = "+incdir+";
  std::istringstream lines(read_file(list, "a list of RTL files"));
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.empty() || line.starts_with("//") || line.starts_with('#')) continue;
    if (line.starts_with(kInclude)) {
      sources.include_folders.push_back(folder / line.substr(kInclude.size()));
      if (sources.include_folders.back().string().find_first_of(" \t\"*?[]") != std::string::npos)
        throw UserError(
            fmt::format("{}:{}: found '{}', expected a folder without blanks in its path, as Yosys does",
                        list.string(), number, line));
    } else if (line[0] == '+' || line[0] == '-') {
      throw UserError(fmt::format("{}:{}: found '{}', expected the name of a file or +incdir+FOLDER",
                                  list.string(), number, line));
    } else {
      sources.files.push_back(folder / line);
      if (sources.files.back().string().find_first_of("*?[]\"\r\n") != std::string::npos)
        throw UserError(
            fmt::format("{}:{}: found {}, expected a path without *, ?, [, ] and quotes, in whose place "
                        "Yosys might read another "
                        "file; move it",
                        list.string(), number, escaped(sources.files.back().string())));
      read_file(sources.files.back(),
                "an RTL file");  // Yosys would wait for a pipe, and read a device without end
    }
  }
  if (sources.files.empty())
    throw UserError(fmt::format("{}: found no file, expected the names of RTL files", list.string()));
  return sources;
}

namespace {

// Where Yosys was when it gave up: the last place that it has named.
std::string last_place(const std::string& output) {
  static const std::regex kPlace("[^\\s`'\"$]+\\.\\w+:\\d+");
  std::string place;
  for (std::sregex_iterator at(output.begin(), output.end(), kPlace), end; at != end; ++at) place = at->str();
  return place.empty() ? "RTL" : place;
}

// Yosys names a process by its file and line 0, and some places with line 0, which is none.
std::string without_line_0(const std::string& error) {
  static const std::regex kLatch(
      ".*(Latch inferred for signal `\\\\?[^']*') from always_comb process "
      "`.*\\$proc\\$(.*):0\\$\\d+'\\.?");
  std::smatch part;
  if (std::regex_match(error, part, kLatch))
    return fmt::format("{}: ERROR: {}; assign it on every path", part[2].str(), part[1].str());
  return std::regex_replace(error, std::regex("(\\.\\w+):0: "), "$1: ");
}

// What Yosys has said, warnings alone.
std::string run_yosys(const std::string& script, const std::filesystem::path& file) {
  write_whole(file, script);
  const Finished yosys = run_tool("yosys", "yosys", {"-q", "-s", file.string()});
  if (yosys.status == 0) return yosys.output;
  std::string error = without_line_0(line_with(yosys.output, "ERROR"));
  if (error.find("yields non-constant value") != std::string::npos)
    error += "; expected one value, and a test of the reset for the level to which its edge leads";
  const bool placed = std::regex_search(error, std::regex("\\.\\w+:(\\d+| )"));
  throw UserError(fmt::format(
      "{}: Yosys refuses it: {}",
      placed ? "RTL" : last_place(run_tool("yosys", "yosys", {"-s", file.string()}).output), error));
}

// Refuses indices that are wider than their array. Tells where Yosys does not show them: it can't read an
// array that is used as a whole as one.
std::string look_at_arrays(const RtlSources& sources, const TemporaryFolder& folder) {
  const std::string netlist = read_file(folder.path() / "netlist.json", "what Yosys read");
  if (!has_arrays_of_flops(netlist)) return "";
  write_whole(folder.path() / "arrays.ys", script_of_arrays(sources, folder));
  const Finished yosys = run_tool("yosys", "yosys", {"-q", "-s", (folder.path() / "arrays.ys").string()});
  if (yosys.status != 0)
    return "RTL: indices of arrays that a reset sets were not looked at: of one that is wider than its array "
           "the lowest "
           "bits count";
  require_narrow_indices(netlist, read_file(folder.path() / "arrays.il", "what Yosys read"));
  return "";
}

}  // namespace

Rtl read_rtl(const RtlSources& sources) {
  const TemporaryFolder folder;
  const std::string said = run_yosys(script_of_rtl(sources, folder), folder.path() / "rtl.ys");
  const std::string modules = read_file(folder.path() / "modules.il", "what Yosys read");
  require_plain_readings(said, modules);
  // What is wrong in it is told by what was read, before Yosys stumbles over it.
  Rtl rtl;
  rtl.netlist = read_netlist(folder.path() / "netlist.json", sources.top);
  rtl.array_note = look_at_arrays(sources, folder);
  const std::string whole = read_file(folder.path() / "rtl.il", "what Yosys read");
  require_narrow_dimensions(whole);
  require_plain_selects(whole, modules);
  write_whole(folder.path() / "bounded.il", with_bounds(whole));
  write_whole(folder.path() / "words.v", kBoundsModule);
  std::string quotients;
  for (const char* cell : {"div", "mod", "divfloor", "modfloor"}) quotients += quotient_by_zero(cell);
  write_whole(folder.path() / "quotients.v", quotients);
  write_whole(folder.path() / "cuts.v", kCuts);
  write_whole(folder.path() / "flops.v", kFlops);
  write_whole(folder.path() / "products.v", kProducts);
  write_whole(folder.path() / "open.v", kOpen);
  run_yosys(script_of_gates(sources.top, folder), folder.path() / "gates.ys");
  return Sorter(read_aiger(folder.path() / "gates.aig"), std::move(rtl)).run();
}

}  // namespace meltstage::hls
