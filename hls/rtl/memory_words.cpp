// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/memory_words.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/error.hpp"

namespace meltstage::hls {

const char* const kBoundsModule = R"(
module hls_words (ADDR, IN, OUT);
  parameter FIRST = 0;
  parameter LAST = 3;
  parameter ABITS = 2;
  parameter WIDTH = 1;
  parameter BEYOND = 1'bx;
  input [ABITS-1:0] ADDR;
  input [WIDTH-1:0] IN;
  output [WIDTH-1:0] OUT;
  wire [ABITS:0] address = ADDR;
  assign OUT = address >= FIRST && address <= LAST ? IN : {WIDTH{BEYOND}};
endmodule
)";

namespace {

// The words of a memory, by their numbers in RTL.
struct Words {
  std::uint64_t first, last;
};

// A cell of RTLIL, line by line, and its parameters and connections.
struct Cell {
  std::vector<std::string> lines;
  std::map<std::string, std::string> words;

  void add(const std::string& line) {
    lines.push_back(line);
    for (const std::string_view begin : {"    parameter \\", "    parameter signed \\", "    connect \\"}) {
      if (!line.starts_with(begin)) continue;
      const std::size_t blank = line.find(' ', begin.size());
      words[line.substr(begin.size(), blank - begin.size())] = line.substr(blank + 1);
    }
  }
};

// A port of a memory, and before it a cell of `kBoundsModule` between it and what it is connected to.
std::string bounded(const Cell& port, const Words& words, std::size_t number, const std::string& attributes) {
  const bool reads = port.lines[0].starts_with("  cell $memrd");
  const std::string name = reads ? "DATA" : "EN", wire = fmt::format("$hls_words_{}${}", name, number),
                    &outside = port.words.at(name);
  std::string text = fmt::format(
      "  wire width {0} {1}\n  cell \\hls_words $hls_words${2}\n    parameter \\FIRST {3}\n    parameter "
      "\\LAST {4}\n"
      "    parameter \\ABITS {5}\n    parameter \\WIDTH {0}\n    parameter \\BEYOND {6}\n    connect \\ADDR "
      "{7}\n"
      "    connect \\IN {8}\n    connect \\OUT {9}\n  end\n",
      port.words.at("WIDTH"), wire, number, words.first, words.last, port.words.at("ABITS"),
      reads ? "1'x" : "1'0", port.words.at("ADDR"), reads ? wire : outside, reads ? outside : wire);
  text += attributes;
  const std::string connection = fmt::format("    connect \\{} ", name);
  for (const std::string& line : port.lines)
    text += (line.starts_with(connection) ? connection + wire : line) + '\n';
  return text;
}

// "memory width 8 size 4 offset 2 \NAME"
void take_memory(const std::string& line, std::map<std::string, Words>& memories) {
  const auto number = [&](const char* word, std::uint64_t otherwise) {
    const std::size_t at = line.find(word);
    return at == std::string::npos ? otherwise : std::stoull(line.substr(at + std::strlen(word)));
  };
  if (line.find(" offset -") != std::string::npos)
    throw UserError(fmt::format("RTL: found memory {}, whose words begin below 0, expected them from 0 on",
                                line.substr(line.rfind('\\') + 1)));
  const std::uint64_t first = number(" offset ", 0);
  memories[line.substr(line.rfind(' ') + 1)] = {first, first + number(" size ", 1) - 1};
}

// Of the parameter MEMID: "\\NAME" in quotes, with its backslashes doubled.
std::string memory_of(const Cell& port) {
  std::string name;
  const std::string& quoted = port.words.at("MEMID");
  for (std::size_t i = 1; i + 1 < quoted.size(); ++i) {
    if (quoted[i] == '\\' && i + 2 < quoted.size()) ++i;
    name += quoted[i];
  }
  return name;
}

}  // namespace

std::string with_bounds(const std::string& rtlil) {
  std::string result, attributes;
  std::map<std::string, Words> memories;
  std::size_t number = 0;
  std::istringstream lines(rtlil);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  attribute ")) {
      attributes += line + '\n';
      continue;
    }
    if (line.starts_with("  memory ")) take_memory(line, memories);
    if (line.starts_with("  cell $memrd") || line.starts_with("  cell $memwr")) {
      Cell port;
      for (port.add(line); line != "  end" && std::getline(lines, line);) port.add(line);
      result += bounded(port, memories.at(memory_of(port)), number++, attributes);
    } else {
      result += attributes + line + '\n';
    }
    attributes.clear();
  }
  return result + attributes;
}

}  // namespace meltstage::hls
