// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/proof_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

namespace {

using Clause = std::vector<int>;

// Clauses with two watched literals each; assignments are undone after every check.
class Checker {
 public:
  void add(Clause clause) {
    std::sort(clause.begin(), clause.end());
    clause.erase(std::unique(clause.begin(), clause.end()), clause.end());
    for (const int literal : clause) grow(literal);
    const std::size_t number = clauses_.size();
    names_[clause].push_back(number);
    if (clause.empty()) contradiction_ = true;
    if (clause.size() == 1) units_.push_back(number);
    clauses_.push_back(std::move(clause));
    alive_.push_back(1);
    if (clauses_[number].size() >= 2) {
      watches_[slot(clauses_[number][0])].push_back(number);
      watches_[slot(clauses_[number][1])].push_back(number);
    }
  }
  bool remove(Clause clause) {
    std::sort(clause.begin(), clause.end());
    const auto found = names_.find(clause);
    if (found == names_.end() || found->second.empty()) return false;
    alive_[found->second.back()] = 0;
    found->second.pop_back();
    return true;
  }
  // Unit propagation of the clause's negation meets a contradiction.
  bool follows(const Clause& clause) {
    for (const int literal : clause) grow(literal);
    bool conflict = contradiction_;
    trail_.clear();
    for (const int literal : clause) conflict = conflict || !assign(-literal);
    for (const std::size_t unit : units_) {
      if (alive_[unit] != 0) conflict = conflict || !assign(clauses_[unit][0]);
    }
    for (std::size_t i = 0; i < trail_.size() && !conflict; ++i) conflict = !propagate(-trail_[i]);
    for (const int literal : trail_) value_[slot(literal)] = value_[slot(-literal)] = 0;
    return conflict;
  }

 private:
  static std::size_t slot(int literal) {
    return 2 * static_cast<std::size_t>(std::abs(literal)) + (literal < 0 ? 1 : 0);
  }
  void grow(int literal) {
    const std::size_t size = 2 * static_cast<std::size_t>(std::abs(literal)) + 2;
    if (value_.size() >= size) return;
    value_.resize(size, 0);
    watches_.resize(size);
  }
  bool assign(int literal) {
    if (value_[slot(literal)] != 0) return value_[slot(literal)] > 0;
    value_[slot(literal)] = 1;
    value_[slot(-literal)] = -1;
    trail_.push_back(literal);
    return true;
  }
  // Clauses that watch `literal`, which has become false.
  bool propagate(int literal) {
    auto& list = watches_[slot(literal)];
    std::size_t kept = 0;
    bool good = true;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::size_t number = list[i];
      Clause& clause = clauses_[number];
      if (alive_[number] == 0) continue;
      if (!good) {
        list[kept++] = number;
        continue;
      }
      if (clause[0] == literal) std::swap(clause[0], clause[1]);
      bool moved = false;
      if (value_[slot(clause[0])] <= 0) {
        for (std::size_t k = 2; k < clause.size() && !moved; ++k) {
          if (value_[slot(clause[k])] < 0) continue;
          std::swap(clause[1], clause[k]);
          watches_[slot(clause[1])].push_back(number);
          moved = true;
        }
      }
      if (moved) continue;
      list[kept++] = number;
      good = assign(clause[0]);
    }
    list.resize(kept);
    return good;
  }

  std::vector<Clause> clauses_;
  std::vector<char> alive_;
  std::map<Clause, std::vector<std::size_t>> names_;  // sorted literals: the clauses' numbers
  std::vector<std::vector<std::size_t>> watches_;
  std::vector<signed char> value_;
  std::vector<int> trail_;
  std::vector<std::size_t> units_;
  bool contradiction_ = false;
};

// As many clauses as the problem line "p cnf VARIABLES CLAUSES" says: a file cut short would still be a set
// of clauses, and a proof of it nothing about the whole.
void require_whole(const ProofFile& cnf, std::size_t clauses) {
  std::string_view text = cnf.text;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    const std::size_t at = cnf.text.size() - text.size();
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    if (line.empty() || line[0] != 'p') continue;
    const std::size_t end = line.find_last_not_of(" \r") + 1, begin = line.find_last_of(' ', end) + 1;
    const auto said = number_in<std::size_t>(line.substr(begin, end - begin), 0, cnf.text.size());
    if (!said || line.substr(0, 6) != "p cnf " || *said != clauses)
      throw UserError(defect_at(cnf.name, place_of(cnf.text, at),
                                fmt::format("\"{}\" and {} clauses", shown(line), clauses),
                                fmt::format("p cnf VARIABLES {}, or the whole file", clauses)));
    return;
  }
  throw UserError(defect_at(cnf.name, Place{}, "no problem line", "p cnf VARIABLES CLAUSES"));
}

struct Line {
  bool deletion = false;
  Clause clause;
};

// Lines of literals that end with 0; comments and the problem line are passed over.
std::vector<Line> lines_of(const ProofFile& file) {
  constexpr int kMostVariables = 10'000'000;
  constexpr int kNoLiteral = kMostVariables + 1;
  const std::string_view all = file.text;
  std::string_view text = all;
  const auto fail = [&](std::string_view at, const std::string& found, const std::string& expected) {
    const Place place = place_of(all, static_cast<std::size_t>(at.data() - all.data()));
    throw UserError(defect_at(file.name, place, found, expected));
  };
  std::vector<Line> lines;
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    if (line.empty() || line[0] == 'c' || line[0] == 'p') continue;
    Line entry;
    if (line[0] == 'd') {
      entry.deletion = true;
      line.remove_prefix(1);
    }
    bool ended = false;
    while (!line.empty()) {
      if (line[0] == ' ' || line[0] == '\r') {
        line.remove_prefix(1);
        continue;
      }
      const std::size_t end = std::min(line.find_first_of(" \r"), line.size());
      const int literal =
          number_in(line.substr(0, end), -kMostVariables, kMostVariables).value_or(kNoLiteral);
      if (literal == kNoLiteral)
        fail(line, fmt::format("\"{}\"", shown(line.substr(0, end))),
             fmt::format("literals of at most {} variables and 0", kMostVariables));
      line.remove_prefix(end);
      if (literal == 0) {
        ended = true;
        break;
      }
      entry.clause.push_back(literal);
    }
    if (!ended) fail(line, "no 0 at the end of the line", "one");
    lines.push_back(std::move(entry));
  }
  return lines;
}

}  // namespace

bool refutes(const ProofFile& cnf, const ProofFile& proof, std::string& reason) {
  Checker checker;
  std::vector<Line> clauses = lines_of(cnf);
  require_whole(cnf, clauses.size());
  for (Line& line : clauses) checker.add(std::move(line.clause));
  std::size_t step = 0;
  for (Line& line : lines_of(proof)) {
    ++step;
    if (line.deletion) {
      if (line.clause.size() > 1)
        checker.remove(std::move(line.clause));  // a unit's effect stays, as in drat-trim
      continue;
    }
    if (!checker.follows(line.clause)) {
      reason = fmt::format("step {} of the proof does not follow by unit propagation", step);
      return false;
    }
    if (line.clause.empty()) return true;
    checker.add(std::move(line.clause));
  }
  reason = "the proof ends without the empty clause";
  return false;
}

}  // namespace meltstage::dft
