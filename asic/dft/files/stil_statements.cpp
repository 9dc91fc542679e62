// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <utility>

#include "asic/dft/files/stil_blocks.hpp"
#include "base/place.hpp"

namespace meltstage::dft::stil {

void Reader::read_routines(std::string_view kind, Routines& into) {
  expect("{");
  while (!is("}")) {
    const std::size_t where = token_.where;
    const std::string name = take_name();
    expect("{");
    if (!into.emplace(name, statements()).second)
      fail(where, fmt::format("{} \"{}\" again", kind, shown(name)), "each once in its block");
  }
  expect("}");
}

std::vector<Statement> Reader::statements(std::size_t depth) {
  std::vector<Statement> list;
  std::string label;
  const std::size_t opened = token_.where;
  if (depth > kMostNested)
    fail(opened, fmt::format("statements {} deep", depth), fmt::format("at most {}", kMostNested));
  while (!is("}")) {
    if (token_.kind == Token::Kind::end) fail(opened, "a block left open", "\"}\"");
    const std::size_t where = token_.where;
    const bool string = token_.kind == Token::Kind::string;
    const std::string word = take_name();
    if (is(":")) {
      advance();
      label = word;
      continue;
    }
    if (string) fail(where, fmt::format("\"{}\"", word), "a statement or a label with \":\"");
    Statement statement;
    statement.where = where;
    statement.label = std::move(label);
    label.clear();
    if (word == "W" || word == "WaveformTable") {
      statement.kind = Statement::Kind::table;
      statement.name = take_name();
      expect(";");
    } else if (word == "C" || word == "Condition" || word == "F" || word == "Fixed" || word == "V" ||
               word == "Vector") {
      statement.kind = word[0] == 'C'   ? Statement::Kind::condition
                       : word[0] == 'F' ? Statement::Kind::fixed
                                        : Statement::Kind::vector;
      assignments(statement);
    } else if (word == "Call" || word == "Macro") {
      statement.kind = word == "Call" ? Statement::Kind::call : Statement::Kind::macro;
      statement.name = take_name();
      if (is("{"))
        assignments(statement);
      else
        expect(";");
    } else if (word == "Shift") {
      statement.kind = Statement::Kind::shift;
      expect("{");
      statement.body = statements(depth + 1);
    } else if (word == "Loop") {
      statement.kind = Statement::Kind::loop;
      statement.count = number("Loop");
      expect("{");
      statement.body = statements(depth + 1);
    } else if (word == "Stop") {
      statement.kind = Statement::Kind::stop;
      expect(";");
    } else if (word == "Ann" || word == "IddqTestPoint" || word == "BreakPoint") {
      statement.kind = Statement::Kind::note;
      if (is(";")) advance();
      if (is("{")) skip_block();
    } else {
      fail(where, fmt::format("\"{}\"", word), "W, C, F, V, Call, Macro, Shift, Loop or Stop");
    }
    list.push_back(std::move(statement));
  }
  expect("}");
  return list;
}

void Reader::assignments(Statement& statement) {
  expect("{");
  while (!is("}")) {
    Assignment assignment{"", "", token_.where};
    assignment.signals = take_signals();
    if (!is("=")) fail(token_.where, found(), "\"=\"");
    assignment.data = lexer_.data();  // the lexer stands right behind the "="
    advance();
    statement.assignments.push_back(std::move(assignment));
  }
  expect("}");
}

}  // namespace meltstage::dft::stil
