// SPDX-License-Identifier: Apache-2.0
// Options that say where a chip is.
#pragma once

#include <string>

#include "host/controller.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace meltstage::app {

/// What the options are read into.
struct AskedConnection {
  host::Connection connection;
  std::string format = "8E1";

  /// Throws UserError for a character format that isn't one.
  host::Connection checked() const;
};

/// Adds --port, which is returned, --address, --baud, --format and --timeout. `asked` must outlive `command`.
CLI::Option* add_connection(CLI::App* command, AskedConnection& asked);

}  // namespace meltstage::app
