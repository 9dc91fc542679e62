// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <utility>

#include "asic/dft/files/stil_blocks.hpp"
#include "base/place.hpp"

namespace meltstage::dft::stil {

void Reader::read_choice(Choice& choice) {
  const std::size_t where = token_.where;
  const std::string word = take_word();
  if (word == "Procedures" || word == "MacroDefs") {
    const std::size_t at_name = token_.where;
    (word == "Procedures" ? choice.procedures : choice.macros).push_back({take_name(), "", at_name});
    expect(";");
  } else if (word == "SignalGroups" || word == "ScanStructures" || word == "Start" || word == "Stop") {
    take_name();  // all groups and chains are there for all; a tester's marks
    expect(";");
  } else if (word == "Termination") {
    skip_block();
  } else {
    fail(where, fmt::format("\"{}\"", shown(word)),
         "PatList, Procedures, MacroDefs, SignalGroups, ScanStructures, Start, Stop or Termination");
  }
}

Burst Reader::read_burst() {
  Burst burst;
  expect("{");
  while (!is("}")) {
    if (!is_word("PatList")) {
      read_choice(burst.choice);
      continue;
    }
    advance();
    expect("{");
    while (!is("}")) {
      BurstEntry entry;
      entry.where = token_.where;
      entry.pattern = take_name();
      if (is("{")) {
        advance();
        while (!is("}")) read_choice(entry.choice);
        advance();
      } else {
        expect(";");
      }
      burst.entries.push_back(std::move(entry));
    }
    expect("}");
  }
  expect("}");
  return burst;
}

void Reader::read_exec(std::size_t at_exec) {
  if (file_.has_exec)
    fail(at_exec, "a second PatternExec", "one: a file runs as one test; take the others out");
  file_.has_exec = true;
  expect("{");
  while (!is("}")) {
    const std::size_t where = token_.where;
    const std::string word = take_word();
    const std::string name = take_name();
    if (word == "PatternBurst") {
      if (!file_.executed.empty())
        fail(where, fmt::format("a second PatternBurst \"{}\" in the PatternExec", shown(name)), "one");
      file_.executed.push_back({name, "", where});
    }
    expect(";");
  }
  expect("}");
}

}  // namespace meltstage::dft::stil
