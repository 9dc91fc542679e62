// SPDX-License-Identifier: Apache-2.0
#include "tb/regress/suites.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/number.hpp"
#include "base/place.hpp"
#include "base/toml_file.hpp"
#include "suites_text.hpp"
#include "tb/regress/tests.hpp"

namespace meltstage::tb {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMostRuns = 1'000'000;
constexpr std::uint64_t kMostAmount = 1'000'000'000'000;
constexpr double kMostMinutes = 10'000;
constexpr std::int64_t kMostSeed = std::int64_t{1} << 62;

constexpr std::array<Choice<bool>, 2> kCoverage = {{{"open", false}, {"closed", true}}};

void add_runs(TomlSection section, std::vector<RegressRun>& runs) {
  const std::string test = section.text("test", "");
  if (find_test(test) == nullptr) section.fail("test", '"' + test + '"', "one of: " + test_names());
  const auto first = static_cast<std::uint64_t>(section.integer("first", 1, 0, kMostSeed));
  const std::int64_t seeds = section.integer("seeds", 1, 1, kMostRuns);
  if (!section.has("amount"))
    section.fail("amount", "none", "clocks or trials, as meltstage regress list says");
  const auto amount =
      static_cast<std::uint64_t>(section.integer("amount", 0, 1, static_cast<std::int64_t>(kMostAmount)));
  section.finish();
  for (std::int64_t i = 0; i < seeds; ++i)
    runs.push_back({test, first + static_cast<std::uint64_t>(i), amount});
}

Suite suite_of(TomlSection section) {
  Suite suite;
  suite.name = section.text("name", "");
  if (suite.name.empty()) section.fail("name", "none", "a name");
  if (suite.name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") !=
      std::string::npos)
    section.fail("name", '"' + suite.name + '"', "letters, digits, - and _: it names a folder");
  suite.about = section.text("about", "");
  suite.coverage_closed = section.choice("coverage", "open", kCoverage);
  for (TomlSection& run : section.sections("run")) add_runs(run, suite.runs);
  suite.limit_min = section.number("limit_min", suite.limit_min, 1e-3, kMostMinutes);
  if (suite.runs.empty()) section.fail("run", "none", "a run");
  std::set<std::string> names;
  for (const RegressRun& run : suite.runs)
    if (!names.insert(name_of(run)).second) section.fail("run", name_of(run) + " twice", "each once");
  section.finish();
  return suite;
}

std::vector<Suite> suites_of(const fs::path& path, const toml::table& table) {
  TomlSection top(path, &table, "");
  std::vector<Suite> suites;
  std::set<std::string> names;
  for (TomlSection& section : top.sections("suite")) {
    suites.push_back(suite_of(section));
    if (!names.insert(suites.back().name).second)
      section.fail("name", '"' + suites.back().name + "\" twice", "each suite once");
  }
  if (suites.empty()) top.fail("suite", "none", "a [[suite]]");
  top.finish();
  return suites;
}

}  // namespace

std::string name_of(const RegressRun& run) { return fmt::format("{}.{}", run.test, run.seed); }

RegressRun run_of(std::string_view name) {
  const auto dot = name.find('.');
  const auto seed =
      dot == std::string_view::npos
          ? std::nullopt
          : number_in<std::uint64_t>(name.substr(dot + 1), 0, static_cast<std::uint64_t>(kMostSeed));
  if (!seed || find_test(name.substr(0, dot)) == nullptr)
    throw UserError(
        fmt::format("run: found \"{}\", expected TEST.SEED such as random.17, the test one of: {}",
                    shown(name), test_names()));
  return {std::string(name.substr(0, dot)), *seed, 0};
}

std::vector<Suite> standard_suites() { return suites_of("suites.toml", toml::parse(regress_text::kSuites)); }

std::vector<Suite> read_suites(const fs::path& path) {
  return suites_of(path, parse_toml(path, "suites of meltstage regress (TOML)"));
}

const Suite& find_suite(const std::vector<Suite>& suites, std::string_view name) {
  const auto found =
      std::find_if(suites.begin(), suites.end(), [&](const Suite& s) { return s.name == name; });
  if (found != suites.end()) return *found;
  std::vector<std::string> names;
  for (const Suite& suite : suites) names.push_back(suite.name);
  throw UserError(
      fmt::format("suite: found \"{}\", expected one of: {}", shown(name), fmt::join(names, ", ")));
}

Suite with_seeds_moved(Suite suite, std::uint64_t by) {
  for (RegressRun& run : suite.runs) run.seed += by;
  return suite;
}

std::vector<RegressRun> read_failed(const fs::path& path) {
  std::vector<RegressRun> runs;
  if (!fs::exists(path)) return runs;
  std::istringstream lines(read_file(path, "runs that failed, a line each"));
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line.substr(0, line.find('#')));
    std::string name, amount, more;
    if (!(words >> name)) continue;
    words >> amount >> more;
    const auto value = number_in<std::uint64_t>(amount, 1, kMostAmount);
    if (!value || !more.empty())
      throw UserError(
          fmt::format("{}:{}: found \"{}\", expected TEST.SEED AMOUNT such as \"random.17 300000\"",
                      path.string(), number, shown(line)));
    RegressRun run;
    try {
      run = run_of(name);
    } catch (const UserError& error) {
      throw UserError(fmt::format("{}:{}: {}", path.string(), number, error.what()));
    }
    run.amount = *value;
    if (std::find(runs.begin(), runs.end(), run) == runs.end()) runs.push_back(run);
  }
  return runs;
}

}  // namespace meltstage::tb
