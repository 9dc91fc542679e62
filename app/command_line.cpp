// SPDX-License-Identifier: Apache-2.0
#include "app/command_line.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <regex>
#include <string_view>
#include <vector>

#include "app/help_text.hpp"
#include "base/build_stamp.hpp"
#include "base/error.hpp"
#include "base/option_values.hpp"
#include "base/place.hpp"
#include "base/terminal.hpp"

namespace meltstage::app {
namespace {

char** arguments = nullptr;  // of this process, for the program that takes over

// CLI11 counts an option that is given twice as too many values: "--station: At Most 3 required but received
// 6".
std::string number_of_values(const std::string& what) {
  constexpr std::string_view kMost = ": At Most ", kLeast = ": At least ", kFound = " required but received ";
  const auto found = what.find(kFound);
  if (found == std::string::npos) return what;
  for (const std::string_view kind : {kMost, kLeast})
    if (const auto at = what.find(kind); at != std::string::npos && at < found) {
      const auto wanted_at = at + kind.size();
      return fmt::format("{}: found {} values, expected {}{}", what.substr(0, at),
                         what.substr(found + kFound.size()), what.substr(wanted_at, found - wanted_at),
                         kind == kMost ? "; give the option once" : "");
    }
  return what;
}

// CLI11 shows the numbers behind the words: "--rtl: Check maybe value in {chosen->1,full->2} OR {1,2}
// FAILED".
std::string words_to_choose_from(const std::string& what) {
  static const std::regex kRefused("(.*): Check (.*) value in \\{(.*)\\} OR \\{.*\\} FAILED");
  static const std::regex kNumber("->[^,]*"), kComma(",");
  std::smatch part;
  if (!std::regex_match(what, part, kRefused)) return what;
  const std::string words = std::regex_replace(std::regex_replace(part[3].str(), kNumber, ""), kComma, ", ");
  return fmt::format("{}: found {}, expected one of: {}", part[1].str(), part[2].str(), words);
}

// One line of what is wrong with the call. CLI11 says of a missing and of an unknown command only that one is
// required.
std::string usage_error(const CLI::App* root, const CLI::Error& error) {
  const CLI::App* command = root;
  std::string called = "meltstage";
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().back();
    called += " " + command->get_name();
  }
  const std::vector<std::string> unknown = root->remaining(true);
  std::string what = words_to_choose_from(number_of_values(error.what()));
  if (command->get_require_subcommand_min() > 0) {
    std::string known;
    for (const CLI::App* one :
         command->get_subcommands([](const CLI::App* a) { return !a->get_name().empty(); }))
      known += (known.empty() ? "" : ", ") + one->get_name();
    what = (unknown.empty() ? "no command given" : fmt::format("found \"{}\"", unknown.front())) +
           ", expected one of: " + known;
  }
  return fmt::format("{}: {}; {} --help tells more\n", called, escaped(what), called);
}

int fail(std::string_view what, int status) {
  on_stderr(fmt::format("meltstage: {}\n", what));
  return status;
}

// A file that is opened while a standard stream is closed gets that stream's number, and what is told there
// would go into the file. In its place: what takes nothing, so that a lost answer is noticed, and for errors
// what swallows all.
void fill_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0) open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY);
}

// The answer is given only when it has arrived. A stream that fails while it is written throws, too, but
// says so only then.
int with_all_told(int status) {
  std::cout.flush();
  errno = 0;
  const bool lost = std::fflush(stdout) != 0;
  if (!lost && std::ferror(stdout) == 0 && std::cout) return status;
  return fail(fmt::format("standard output: can't be written ({}), expected a place that takes the answer; "
                          "free space or name another",
                          lost && errno != 0 ? std::strerror(errno) : "a write failed"),
              2);
}

}  // namespace

void show_example(CLI::App* command, const std::string& words) {
  command->footer(std::string(kExample) + "meltstage " + words);
}

void continue_as(const std::string& program) {
  const std::filesystem::path path =
      std::filesystem::read_symlink("/proc/self/exe").replace_filename(program);
  execv(path.c_str(), arguments);
  throw UserError(fmt::format("{}: can't be started ({}); build it: ./run --build {}", path.string(),
                              std::strerror(errno), program));
}

namespace {

int carry_out(int argc, char** argv, std::span<const Verb> verbs, std::span<const VerbElsewhere> elsewhere) {
  std::string typed = "meltstage";
  for (int i = 1; i < argc; ++i) typed += std::string(" ") + argv[i];
  try {
    for (const VerbElsewhere& verb : elsewhere)
      if (argc > 1 && std::string(argv[1]) == verb.name) continue_as(verb.program);

    CLI::App cli{"Meltstage: the electronics and motion of a print head.", "meltstage"};
    cli.set_version_flag("--version", version());
    cli.require_subcommand(1);
    cli.formatter(std::make_shared<HelpFormatter>());
    std::vector<Action> actions;
    for (const Verb& verb : verbs) actions.push_back(verb.add(cli, typed));
    if (argc == 2 && std::string_view(argv[1]) == "--describe") {
      fmt::print("{}", command_description(cli));
      return 0;
    }
    for (const VerbElsewhere& verb : elsewhere) cli.add_subcommand(verb.name, verb.summary);
    cli.failure_message(usage_error);
    check_option_values(cli);
    try {
      cli.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      return cli.exit(error) == 0 ? 0 : 2;
    }
    for (std::size_t i = 0; i < verbs.size(); ++i)
      if (cli.got_subcommand(verbs[i].name)) return actions[i]();
    return 2;  // unreachable: one verb is required, and those elsewhere are gone by now
  } catch (const UserError& error) {
    return fail(escaped(error.what()), 2);  // paths and words of a file are in it
  } catch (const std::filesystem::filesystem_error& error) {
    return fail(
        escaped(fmt::format("{}: cannot be used: found \"{}\", expected a place that can be written to",
                            error.path1().string(), error.code().message())),
        2);
  } catch (const std::bad_alloc&) {
    return fail("found too little memory for this input, expected more; split the input", 2);
  } catch (const std::exception& error) {
    if (std::ferror(stdout) != 0) return 2;  // with_all_told() says why
    return fail(error.what(), 1);
  }
}

}  // namespace

int run_verbs(int argc, char** argv, std::span<const Verb> verbs, std::span<const VerbElsewhere> elsewhere) {
  arguments = argv;
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is told like a full disk
  fill_closed_streams();
  return with_all_told(carry_out(argc, argv, verbs, elsewhere));
}

}  // namespace meltstage::app
