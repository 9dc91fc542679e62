// SPDX-License-Identifier: Apache-2.0
// Random step functions three ways: as the compiler runs them, translated and run by Icarus, and proved equal
// to what they were translated to. No program does what C++ leaves undefined.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "tests/support/run_command.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kClocks = 300;

struct Member {
  std::string name;
  unsigned bytes;
  unsigned width;
  bool is_signed;

  std::string type() const { return fmt::format("std::{}int{}_t", is_signed ? "" : "u", 8 * bytes); }
  std::string row(const char* structure) const {
    return fmt::format("HLS_FIELD({}, {}, {})", structure, name, width);
  }
};

// A step function over flops f0.., an array of words and pins x0..; its outputs y0.. are the flops.
class Program {
 public:
  explicit Program(std::uint64_t seed) : random_(seed) {
    for (unsigned i = 0; i < 5; ++i) flops_.push_back(member(fmt::format("f{}", i)));
    for (unsigned i = 0; i < 3; ++i) {
      pins_.push_back(member(fmt::format("x{}", i)));
      pins_.back().is_signed = false;
    }
    for (unsigned i = 0; i < 4; ++i) locals_.push_back(fmt::format("v{}", i));
    step_ = block(3);
    for (const Member& flop : flops_) step_ += store(flop, expression(2));
  }

  std::string cpp() const {
    std::string members, pins, outputs, copies, flop_rows, pin_rows, output_rows;
    for (const Member& flop : flops_) {
      members += fmt::format("  {} {};\n", flop.type(), flop.name);
      outputs += fmt::format("  {} y_{};\n", flop.type(), flop.name);
      copies += fmt::format("  out->y_{0} = s->{0};\n", flop.name);
      flop_rows += "    " + flop.row("State") + ",\n";
      output_rows += fmt::format("    HLS_FIELD(Outputs, y_{}, {}),\n", flop.name, flop.width);
    }
    for (const Member& pin : pins_) {
      pins += fmt::format("  {} {};\n", pin.type(), pin.name);
      pin_rows += "    " + pin.row("Inputs") + ",\n";
    }
    for (unsigned i = 0; i < 4; ++i)
      flop_rows += fmt::format(
          "    meltstage::hls::field<std::uint16_t>(\"words[{0}]\", offsetof(State, words) + {1}, 16),\n", i,
          2 * i);
    std::string locals;
    for (const std::string& local : locals_) locals += fmt::format("  std::uint64_t {} = s->f0;\n", local);
    return "#include <cstdint>\n#include \"hls/interface.hpp\"\nusing u64 = std::uint64_t;\nstruct State "
           "{\n" +
           members + "  std::uint16_t words[4];\n};\nstruct Inputs {\n  std::uint8_t rst_ni;\n" + pins +
           "};\nstruct Outputs {\n" + outputs +
           "};\nextern \"C\" {\nvoid hls_reset(State* s) { *s = {}; s->f1 = 1; s->words[2] = 77; }\n"
           "void hls_step(State* s, const Inputs* in) {\n  if (in->rst_ni == 0) return hls_reset(s);\n" +
           locals + step_ + "}\nvoid hls_outputs(const State* s, const Inputs*, Outputs* out) {\n" + copies +
           "}\nextern const meltstage::hls::Field hls_flops[] = {\n" + flop_rows +
           "};\nextern const meltstage::hls::Field hls_input_pins[] = {\n    HLS_FIELD(Inputs, rst_ni, "
           "1),\n" +
           pin_rows + "};\nextern const meltstage::hls::Field hls_output_pins[] = {\n" + output_rows +
           "};\n}\n";
  }

  // Prints pins and the outputs behind the clock, in hexadecimal.
  std::string driver() const {
    std::string draw, print;
    for (const Member& pin : pins_) {
      draw += fmt::format("    in.{} = static_cast<{}>(random() & {}u);\n", pin.name, pin.type(),
                          mask(pin.width));
      print += fmt::format("    std::printf(\"%llx \", 0ull + in.{});\n", pin.name);
    }
    for (const Member& flop : flops_)
      print += fmt::format("    std::printf(\"%llx \", static_cast<unsigned long long>(out.y_{}) & {}u);\n",
                           flop.name, mask(flop.width));
    return fmt::format(
        "#include <cstdio>\n#include <random>\n#include \"block.cpp\"\nint main() {{\n  std::mt19937_64 "
        "random(7);\n"
        "  State s{{}};\n  for (int i = 0; i < {}; ++i) {{\n    Inputs in{{}};\n    Outputs out{{}};\n"
        "    in.rst_ni = i > 1 && i % 97 != 0;\n{}    hls_step(&s, &in);\n    hls_outputs(&s, &in, &out);\n"
        "    std::printf(\"%x \", in.rst_ni);\n{}    std::printf(\"\\n\");\n  }}\n}}\n",
        kClocks, draw, print);
  }

  std::string bench() const {
    std::string declare, scan, formats, connect, check;
    std::string names = "rst_ni";
    for (const Member& pin : pins_) {
      declare += fmt::format("  logic [{}:0] {};\n", pin.width - 1, pin.name);
      connect += fmt::format(", .{0}({0})", pin.name);
      names += ", " + pin.name;
      formats += "%h ";
    }
    for (const Member& flop : flops_) {
      declare += fmt::format("  logic [{0}:0] y_{1}, e_{1};\n", flop.width - 1, flop.name);
      connect += fmt::format(", .y_{0}(y_{0})", flop.name);
      names += ", e_" + flop.name;
      formats += "%h ";
      check += fmt::format(
          "      if (y_{0} !== e_{0}) begin $display(\"clock %0d: {0} is %h, expected %h\", i, y_{0}, "
          "e_{0}); $finish; end\n",
          flop.name);
    }
    return fmt::format(
        "module bench;\n  logic clk_i = 0, rst_ni = 0;\n{}  block dut (.clk_i(clk_i), .rst_ni(rst_ni){});\n"
        "  int file, got;\n  initial begin\n    file = $fopen(\"vectors\", \"r\");\n    for (int i = 0; i < "
        "{}; ++i) begin\n"
        "      got = $fscanf(file, \"%h {}\\n\", {});\n      #1 clk_i = 1;\n      #1;\n{}      clk_i = 0;\n  "
        "    #1;\n"
        "    end\n    $display(\"same\");\n    $finish;\n  end\nendmodule\n",
        declare, connect, kClocks, formats, names, check);
  }

 private:
  unsigned pick(unsigned count) { return static_cast<unsigned>(random_() % count); }
  static std::string mask(unsigned width) {
    return fmt::format("{:#x}", width == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << width) - 1);
  }

  Member member(std::string name) {
    const unsigned bytes = pick(8) == 0 ? 8 : 1u << pick(3);
    return {std::move(name), bytes, pick(3) == 0 ? 2 + pick(8 * bytes - 1) : 8 * bytes, pick(2) == 0};
  }

  // A number of 64 bits without sign; small operands keep products within reach of the proof.
  std::string expression(unsigned depth) {
    if (depth == 0 || pick(6) == 0) return leaf();
    const auto a = [&] { return expression(depth - 1); };
    const char* kSmall = "0xFF";
    switch (pick(17)) {
      case 0:
        return fmt::format("({} + {})", a(), a());
      case 1:
        return fmt::format("({} - {})", a(), a());
      case 2:
        return fmt::format("(({} & {}) * ({} & {}))", a(), kSmall, a(), kSmall);
      case 3:
        return fmt::format("(({} & {}) * u64{{{}}})", a(), kSmall, pick(300));
      case 4:
        return fmt::format("({} << ({} & 63))", a(), a());
      case 5:
        return fmt::format("({} >> ({} & 63))", a(), a());
      case 6:
        return fmt::format("u64(std::int64_t({}) >> ({} & 31))", a(), a());
      case 7:
        return fmt::format("({} ^ {})", a(), a());
      case 8:
        return fmt::format("({} & ~{})", a(), a());
      case 9:
        return fmt::format("({} | {})", a(), a());
      case 10:
        return fmt::format("({} < {} ? {} : {})", a(), a(), a(), a());
      case 11:
        return fmt::format("u64(std::int64_t({}) < std::int64_t({}))", a(), a());
      case 12:
        return fmt::format("u64(std::int8_t({}) * std::int8_t({}))", leaf(), leaf());
      case 13:
        return fmt::format("u64(std::int{}_t({}))", 8u << pick(3), a());
      case 14:
        return fmt::format("(({} & 0xFF) {} {})", a(), pick(2) == 0 ? "/" : "%", 1 + pick(40));
      case 15:
        return fmt::format("u64(s->words[{} & 3])", a());
      default:
        return fmt::format("({} == {} ? {} : {})", a(), a(), a(), a());
    }
  }

  std::string leaf() {
    switch (pick(5)) {
      case 0:
        return fmt::format("u64{{{:#x}}}", random_() >> pick(64));
      case 1:
        return fmt::format("u64(in->{})", pins_[pick(static_cast<unsigned>(pins_.size()))].name);
      case 2:
        return locals_[pick(static_cast<unsigned>(locals_.size()))];
      default:
        return fmt::format("u64(s->{})", flops_[pick(static_cast<unsigned>(flops_.size()))].name);
    }
  }

  static std::string store(const Member& flop, const std::string& value) {
    const unsigned above = 8 * flop.bytes - flop.width;
    if (above == 0) return fmt::format("  s->{} = static_cast<{}>({});\n", flop.name, flop.type(), value);
    if (!flop.is_signed)
      return fmt::format("  s->{} = static_cast<{}>({} & {}u);\n", flop.name, flop.type(), value,
                         mask(flop.width));
    return fmt::format("  s->{0} = static_cast<{1}>(static_cast<{1}>({2} << {3}) >> {3});\n", flop.name,
                       flop.type(), value, above);
  }

  std::string block(unsigned depth) {
    std::string text;
    for (unsigned i = 0; i < 1 + pick(3); ++i) text += statement(depth);
    return text;
  }

  std::string statement(unsigned depth) {
    switch (depth == 0 ? 0 : pick(6)) {
      case 1:
        return fmt::format("  if (({} & 7) > {}) {{\n{}  }} else {{\n{}  }}\n", expression(1), pick(7),
                           block(depth - 1), block(depth - 1));
      case 2: {
        std::string cases;
        for (unsigned i = 0; i < 3; ++i)
          cases += fmt::format("  case {}:\n{}{}", 2 * i + pick(2), block(depth - 1),
                               pick(4) == 0 ? "" : "  break;\n");
        return fmt::format("  switch ({} & 7) {{\n{}  default:\n{}  }}\n", expression(1), cases,
                           block(depth - 1));
      }
      case 3:
        return fmt::format("  for (unsigned i = 0; i < {}; ++i) {} += s->words[i] ^ i * ({} & 0xFF);\n",
                           1 + pick(4), locals_[pick(4)], leaf());
      case 4:
        return fmt::format("  s->words[{} & 3] = static_cast<std::uint16_t>({});\n", expression(1),
                           expression(2));
      default:
        return fmt::format("  {} = {};\n", locals_[pick(4)], expression(2));
    }
  }

  std::mt19937_64 random_;
  std::vector<Member> flops_, pins_;
  std::vector<std::string> locals_;
  std::string step_;
};

// Empty when all three agree.
std::string disagreement(std::uint64_t seed, const fs::path& folder, unsigned conflicts) {
  const auto write = [&](const char* name, const std::string& text) { std::ofstream(folder / name) << text; };
  const Program program(seed);
  write("block.cpp", program.cpp());
  write("driver.cpp", program.driver());
  write("bench.sv", program.bench());
  write("list.f", "block.sv\n");
  const std::string in = "cd " + folder.string() + " && ";
  const auto all = [&](const std::string& line) -> std::string {
    const Ran ran = run_shell(in + line);
    return ran.status == 0 ? "" : fmt::format("{}\n{}", line, ran.output);
  };
  const std::string include = MELTSTAGE_SOURCE_DIR;
  const std::string options = " --option=-I" + include;
  for (const std::string& line :
       {"clang++-14 -std=c++20 -O0 -fsanitize=undefined -fno-sanitize-recover=all -I" + include +
            " driver.cpp -o driver && ./driver > vectors",
        std::string(MELTSTAGE_COMMAND) + " hls translate block.cpp" + options +
            " --module block --out block.sv",
        std::string("iverilog -g2012 -o bench.vvp block.sv bench.sv && vvp -n bench.vvp > said; cat said; "
                    "grep -qx same said")}) {
    if (const std::string wrong = all(line); !wrong.empty()) return wrong;
  }
  if (conflicts == 0) return "";
  const Ran proof = run_shell(in + MELTSTAGE_COMMAND + " hls prove block.cpp" + options +
                              " --rtl list.f --top block --conflicts " + std::to_string(conflicts));
  if (proof.status == 0 || proof.output.find("\nnot decided: ") != std::string::npos) {
    const std::size_t verdict = proof.output.rfind('\n', proof.output.size() - 2);
    fmt::print("{}", proof.output.substr(verdict == std::string::npos ? 0 : verdict + 1));
    return "";
  }
  return proof.output;
}

}  // namespace
}  // namespace meltstage

int main(int argc, char** argv) {
  std::uint64_t seed = 1;
  unsigned count = 3;
  unsigned conflicts = 5000;
  CLI::App cli("Random step functions: run, translated, and proved equal to their translation");
  cli.add_option("--seed", seed, "Of the first one; the others follow")->capture_default_str();
  cli.add_option("--count", count, "Programs")->capture_default_str();
  cli.add_option("--conflicts", conflicts, "Of the SAT solver, for a bit; 0: no proof")
      ->capture_default_str();
  CLI11_PARSE(cli, argc, argv);
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("meltstage_random_programs.{}", getpid());
  std::filesystem::create_directories(folder);
  for (unsigned i = 0; i < count; ++i) {
    fmt::print("--seed {} --count 1\n", seed + i);
    const std::string wrong = meltstage::disagreement(seed + i, folder, conflicts);
    if (wrong.empty()) continue;
    fmt::print("{}its files are in {}\n", wrong, folder.string());
    return 1;
  }
  std::filesystem::remove_all(folder);
  return 0;
}
