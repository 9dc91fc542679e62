// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/layout_main.hpp"

#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <string_view>

#include "base/error.hpp"
#include "base/option_values.hpp"
#include "base/place.hpp"

namespace meltstage::layout {
namespace {

int refused(const CLI::App& app, std::string_view what) {
  fmt::print(stderr, "{}: {}\n", app.get_name(), escaped(what));
  return 2;
}

}  // namespace

int layout_main(CLI::App& app, int argc, char** argv, const std::function<int()>& run) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is told like a full disk
  check_option_values(app);
  try {
    app.parse(argc, argv);
    const int status = run();
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      return refused(app, "standard output: can't be written, expected a place that takes the answer");
    return status;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return refused(app, fmt::format("{}; --help tells more", error.what()));
  } catch (const UserError& error) {
    return refused(app, error.what());
  } catch (const std::system_error& error) {
    return refused(app, error.what());
  }
}

}  // namespace meltstage::layout
