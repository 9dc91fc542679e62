// SPDX-License-Identifier: Apache-2.0
// What the programs of mutants share: the list, the choice of some, a process for each, verdicts that are
// kept, and the tables. docs/verify/mutation.md
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace meltstage::tb {

struct Mutant {
  unsigned number = 0;
  std::string file, line, branch, kind, change, text;
};

/// Rows of a list that mutate.py or mutate_model.py has written. Throws UserError when there are none.
std::vector<Mutant> read_mutants(const std::filesystem::path& path);

enum class Fate { kKilled, kEqual, kHole, kOpen };
constexpr std::array<const char*, 4> kFates = {"killed", "equal", "HOLE", "OPEN"};

struct Verdict {
  Fate fate = Fate::kOpen;
  std::string text;  // one line
};

/// The year and its week, for another sample each week.
std::uint64_t this_week();

/// Options of each program.
struct Choice {
  std::vector<unsigned> only = {};  ///< all when empty
  std::size_t sample = 0;           ///< so many of them, all when 0
  std::uint64_t seed = this_week();
  unsigned jobs = 1;
  double most_left = 0.5;  ///< percent
  std::filesystem::path folder = {};
};
void add_choice(CLI::App& cli, Choice& choice);

/// Those of `mutants` that are asked, in an order that the seed draws, so that a run that was ended has
/// judged a fair sample. Throws UserError on a number that is none.
std::vector<Mutant> chosen(std::vector<Mutant> mutants, const Choice& choice);

/// Told `s` or `p` when a simulation or a proof begins.
using Begins = std::function<void(char)>;

/// Judges each in a process of its own, so many at once: a run may end its process or not end at all. `take`
/// gets the verdicts in this process.
void judge_all(const std::vector<const Mutant*>& list, unsigned jobs,
               const std::function<Verdict(const Mutant&, const Begins&)>& judge,
               const std::function<void(const Mutant&, const Verdict&)>& take);

/// FOLDER/verdicts.tsv: number, fate, text. Those of another build of this program are begun anew.
class Verdicts {
 public:
  explicit Verdicts(const std::filesystem::path& folder);

  bool has(unsigned number) const { return list_.contains(number); }
  const Verdict& of(unsigned number) const { return list_.at(number); }
  void add(unsigned number, const Verdict& verdict);

 private:
  void write(unsigned number, const Verdict& verdict);

  std::filesystem::path path_;
  std::map<unsigned, Verdict> list_;
  std::ofstream out_;
};

/// A line a mutant, and tables. Returns the percentage of holes and open ones.
double print_verdicts(const std::vector<Mutant>& all, const Verdicts& verdicts, double most_left);

}  // namespace meltstage::tb
