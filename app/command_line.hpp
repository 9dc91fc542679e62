// SPDX-License-Identifier: Apache-2.0
// What the `meltstage` programs share: a command line of verbs, one line for each error, and the way from one
// program to the next.
#pragma once

#include <functional>
#include <span>
#include <string>

namespace CLI {
class App;
}

namespace meltstage::app {

/// Carries a verb out once its options are read; returns the exit status.
using Action = std::function<int()>;

/// A verb of this program: its subcommand, added to the command line. `typed` is the whole line, for reports.
using AddVerb = Action (*)(CLI::App& cli, const std::string& typed);
struct Verb {
  const char* name;
  AddVerb add;
};

/// A verb that another program carries out, which lies beside this one.
struct VerbElsewhere {
  const char* name;
  const char* summary;
  const char* program;
};

/// Exit status: 0 good, 1 the job's own verdict is bad, 2 wrong input or use, told in one line;
/// an answer that standard output did not take is the latter.
int run_verbs(int argc, char** argv, std::span<const Verb> verbs, std::span<const VerbElsewhere> elsewhere);

/// A whole call of `command`, shown below its help: the words behind `meltstage`.
void show_example(CLI::App* command, const std::string& words);

/// This process becomes `program`, which lies beside this one, with the same arguments. Throws UserError when
/// it isn't there.
[[noreturn]] void continue_as(const std::string& program);

}  // namespace meltstage::app
