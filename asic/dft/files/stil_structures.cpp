// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "asic/dft/files/stil_blocks.hpp"
#include "base/place.hpp"

namespace meltstage::dft::stil {

namespace {

// Words of a ScanChain; the last four change nothing that a tester plays.
constexpr std::array<std::string_view, 9> kChainWords = {"ScanLength",      "ScanIn",         "ScanOut",
                                                         "ScanInversion",   "ScanCells",      "ScanOutLength",
                                                         "ScanMasterClock", "ScanSlaveClock", "ScanCellType"};

}  // namespace

void Reader::read_chains() {
  expect("{");
  while (!is("}")) {
    expect_word("ScanChain");
    const std::string name = take_name();
    std::size_t length = 0;
    std::string in, out, inversion;
    std::vector<std::string> cells;
    std::vector<std::size_t> inversions;
    const std::size_t where = token_.where;
    expect("{");
    while (!is("}")) {
      if (token_.kind == Token::Kind::end) fail(where, "ScanChain left open", "\"}\"");
      const std::size_t at_word = token_.where;
      const std::string word = take_word();
      if (std::find(kChainWords.begin(), kChainWords.end(), word) == kChainWords.end())
        fail(at_word, fmt::format("\"{}\"", shown(word)),
             "a word of ScanChain (ScanLength, ScanIn, ScanOut, ScanInversion, ScanCells ...)");
      if (word == "ScanLength") length = number("ScanLength");
      if (word == "ScanIn") in = take_name();
      if (word == "ScanOut") out = take_name();
      if (word == "ScanInversion") inversion = take_word();
      if (word == "ScanCells")
        read_cells(cells, inversions);
      else if (word == "ScanCellType")
        skip_to_block_or_end();
      else
        skip_to_end();
    }
    expect("}");
    if (!cells.empty() && cells.size() != length)
      fail(where, fmt::format("{} cells in ScanChain \"{}\"", cells.size(), name),
           fmt::format("{}, its ScanLength", length));
    const std::string_view parity = inversions.size() % 2 == 0 ? "0" : "1";
    if (!cells.empty() && !inversion.empty() && inversion != parity)
      fail(where,
           fmt::format("ScanInversion {} and {} marks in the ScanCells of \"{}\"", inversion,
                       inversions.size(), name),
           fmt::format("ScanInversion {}", parity));
    for (const std::string& port : {in, out}) {
      if (!port.empty()) file_.members(port, where);
    }
    file_.longest_chain = std::max(file_.longest_chain, length);
    file_.chains.push_back({name, in, out, std::move(cells), std::move(inversions)});
  }
  expect("}");
}

void Reader::read_cells(std::vector<std::string>& cells, std::vector<std::size_t>& inversions) {
  const bool braces = is("{");
  if (braces) advance();
  for (; !is("}") && token_.kind != Token::Kind::end && (braces || !is(";")); advance()) {
    if (is(";")) continue;
    if (token_.kind == Token::Kind::word && token_.text == "!")
      inversions.push_back(cells.size());
    else if (token_.kind == Token::Kind::word || token_.kind == Token::Kind::string)
      cells.push_back(token_.text);
    else
      fail(token_.where, found(), "the name of a cell or !");
  }
  expect(braces ? "}" : ";");
  if (braces && is(";")) advance();
}

}  // namespace meltstage::dft::stil
