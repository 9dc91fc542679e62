// SPDX-License-Identifier: Apache-2.0
// `meltstage page`: the chip in a page, as a file.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/chip/scenario_file.hpp"
#include "app/verbs.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "chip_page.hpp"

namespace meltstage::app {
namespace {

struct Options {
  std::filesystem::path out = "chip.html";
  std::filesystem::path scenario;
};

// As JSON that may stand within an HTML element.
std::string within_html(const std::string& text) {
  std::string json = nlohmann::json(text).dump();
  for (std::size_t at = 0; (at = json.find('<', at)) != json.npos;) json.replace(at, 1, "\\u003c");
  return json;
}

int write_page(const Options& options) {
  std::string page(page_text::kPage, sizeof(page_text::kPage) - 1);
  if (!options.scenario.empty()) {
    require_other_file(options.out, {options.scenario});
    constexpr std::string_view kMark = R"(id="given">null)";
    constexpr std::size_t kNull = 4;
    const std::size_t at = page.find(kMark) + kMark.size() - kNull;
    page.replace(at, kNull, within_html(scenario_text(options.scenario)));
  }
  write_whole(options.out, page);
  fmt::print("{}: open it in a browser; it needs no network\n", escaped(options.out.string()));
  return 0;
}

}  // namespace

Action add_page_command(CLI::App& cli, const std::string&) {
  CLI::App* command = cli.add_subcommand(
      "page", "Write the chip as a page that runs in a browser (docs/start/chip-in-a-page.md)");
  show_example(command, "page --out chip.html");
  const auto options = std::make_shared<Options>();
  command->add_option("--out", options->out, "The file to write (default chip.html)");
  command->add_option("--scenario", options->scenario, "What happens to the chip and when");
  return [=] { return write_page(*options); };
}

}  // namespace meltstage::app
