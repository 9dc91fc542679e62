// SPDX-License-Identifier: Apache-2.0
// `meltstage live`: a chip in a browser.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "app/chip/connection_options.hpp"
#include "app/chip/scenario_file.hpp"
#include "app/live/access.hpp"
#include "app/live/bench.hpp"
#include "app/live/chip_source.hpp"
#include "app/live/feed.hpp"
#include "app/live/run_files.hpp"
#include "app/live/samples.hpp"
#include "app/live/server.hpp"
#include "app/live/virtual_source.hpp"
#include "app/number_range.hpp"
#include "app/verbs.hpp"
#include "base/error.hpp"
#include "base/terminal.hpp"
#include "cmodel/spec.hpp"
#include "tb/scenario/scenario.hpp"

namespace meltstage::app {
namespace {

// A line is called lost after three times as long without an answer.
constexpr double kTimeout_s = 0.3;

// Of --simulate: a head on which nothing happens by itself.
constexpr std::string_view kColdHead = "default";

struct Options {
  AskedConnection line;
  std::string listen = "127.0.0.1:8123";
  std::filesystem::path token_file;
  std::optional<std::string> token;  // the file's
  std::filesystem::path keep;        // folder of runs; empty: none is kept
  std::string scenario;              // empty: a chip on a port
  double speed = 1.0;
};

// What the page names.
std::string about_json(const live::Source& source) {
  nlohmann::json states = nlohmann::json::array();
  for (const chip::spec::StateInfo& state : chip::spec::kStates) states.push_back(state.name);
  return nlohmann::json{{"place", source.place()}, {"virtual", source.is_virtual()}, {"states", states}}.dump(
      -1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Told when it changes: whether the run is kept.
std::string kept_json(const live::RunFile& file, const std::string& problem) {
  return nlohmann::json{{"name", file.name()}, {"problem", problem}}.dump();
}

void serve(live::Source& source, live::Listener listener, const Options& options) {
  const std::string where = authority(listener.address);
  live::Samples samples;
  live::Feed feed;
  feed.tell_state("about", about_json(source));
  std::optional<live::RunFile> file;
  live::Documents documents{{"/samples", [&](const std::string&) { return samples.json(); }}};
  if (!options.keep.empty()) {
    file.emplace(options.keep);
    feed.tell_state("kept", kept_json(*file, ""));
    documents["/runs"] = [&](const std::string&) { return live::runs_json(options.keep); };
    documents[fmt::format("/runs/({})", live::kRunName)] = [&](const std::string& name) {
      return live::run_json(options.keep, name);
    };
  }
  std::string problem;
  const auto keep = [&](const live::Sample& sample) {
    samples.add(sample);
    if (!file) return;
    const std::string now = file->add(sample);
    if (now != std::exchange(problem, now)) feed.tell_state("kept", kept_json(*file, problem));
  };
  live::Bench bench(source, feed, keep);
  const live::Server server(std::move(listener), options.token, feed, bench, std::move(documents));
  fmt::print("{}: http://{}/{}; ends with Ctrl-C\n", source.place(), where,
             options.token ? "?token=..." : "");
  std::fflush(stdout);
  while (!server.ended()) {
    throw_if_interrupted();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  throw std::runtime_error("the server can't listen any more, expected the system to let it; start it again");
}

std::unique_ptr<live::Source> make_source(const Options& options) {
  if (options.scenario.empty()) return std::make_unique<live::ChipSource>(options.line.checked());
  const std::string text = options.scenario == kColdHead ? "" : scenario_text(options.scenario);
  return std::make_unique<live::VirtualSource>(tb::parse_scenario(text).scenario, options.speed);
}

int live_bench(Options options) {
  const live::Address address = live::parse_address(options.listen);
  if (!options.token_file.empty()) options.token = live::read_token(options.token_file);
  if (!address.loopback && !options.token)
    throw UserError(
        fmt::format("--listen: found {}, which others reach, expected a loopback address; give --token FILE "
                    "with a secret of 16 characters or more",
                    options.listen));
  live::Listener listener(address);
  const std::unique_ptr<live::Source> source = make_source(options);
  catch_interrupts();
  try {
    serve(*source, std::move(listener), options);
  } catch (const Interrupted&) {
  }
  return 0;
}

}  // namespace

Action add_live_command(CLI::App& cli, const std::string&) {
  CLI::App* command = cli.add_subcommand("live", "Show and operate a chip in a browser (docs/start/live.md)");
  show_example(command, "live --simulate default");
  const auto options = std::make_shared<Options>();
  options->line.connection.timeout_s = kTimeout_s;
  CLI::Option* port = add_connection(command, options->line);
  CLI::Option* simulate = command->add_option(
      "--simulate", options->scenario,
      "Instead of --port: the virtual chip, with the events of this scenario; `default` has none");
  command->add_option("--speed", options->speed, "Chip time over real time of the virtual chip (default 1)")
      ->needs(simulate)
      ->check(number_from(0.0, live::kFastest));
  simulate->excludes(port);
  command->add_option("--keep", options->keep,
                      "Folder in which each run is kept as CSV, to be compared later");
  command->add_option("--listen", options->listen,
                      "ADDRESS:PORT to serve the page at, port 0 for a free one (default 127.0.0.1:8123)");
  command->add_option(
      "--token", options->token_file,
      "File with a secret that each request must bring; without it only this machine is served");
  return [=] {
    if (!*port && !*simulate)
      throw UserError("live: found neither --port nor --simulate, expected one of them");
    return live_bench(*options);
  };
}

}  // namespace meltstage::app
