// SPDX-License-Identifier: Apache-2.0
#include "app/chip/connection_options.hpp"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace meltstage::app {

host::Connection AskedConnection::checked() const {
  host::Connection with_format = connection;
  with_format.format = host::parse_format(format);
  return with_format;
}

CLI::Option* add_connection(CLI::App* command, AskedConnection& asked) {
  command->add_option("--address", asked.connection.address, "The chip's address, 1 to 247 (default 1)");
  command->add_option("--baud", asked.connection.baud, "Baud rate (default 115200)");
  command->add_option("--format", asked.format, "Character format: 8E1 (default), 8O1, 8N2, 8N1");
  command->add_option(
      "--timeout", asked.connection.timeout_s,
      fmt::format("Seconds to wait for an answer, three times (default {:g})", asked.connection.timeout_s));
  return command->add_option("--port", asked.connection.device, "Serial port, or the link of `chip serve`");
}

}  // namespace meltstage::app
