// SPDX-License-Identifier: Apache-2.0
// Answers for programs: --json. What each verb's answer holds stands in docs/start/answers.schema.json.
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace meltstage::app {

inline constexpr char kJsonHelp[] = "Print JSON (docs/start/answers.schema.json)";

/// On standard output. Bytes of a file that are no UTF-8 become U+FFFD.
inline void print_json(const nlohmann::ordered_json& answer) {
  fmt::print("{}\n", answer.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

}  // namespace meltstage::app
