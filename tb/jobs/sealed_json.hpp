// SPDX-License-Identifier: Apache-2.0
// JSON files of a work folder, with a hash of their content: what a killed worker or another program left is
// no result.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "base/error.hpp"

namespace meltstage::tb {

using Json = nlohmann::ordered_json;

std::string content_hash(const Json& content);

// Whether the file is of the format, however damaged.
bool is_sealed(const std::filesystem::path& path, const char* format);
// The file appears whole.
void write_sealed(const std::filesystem::path& path, const char* format, const Json& content);
// The content. Throws UserError for what is no such file, is of another version, or is damaged.
Json read_sealed(const std::filesystem::path& path, const char* format);

// A sealed file whose fields are missing or of another kind was not written by this version.
template <class Read>
auto with_fields(const std::filesystem::path& path, Read read) {
  try {
    return read();
  } catch (const nlohmann::json::exception& error) {
    throw UserError(fmt::format("{}: unexpected content ({}); make it again", path.string(), error.what()));
  }
}

}  // namespace meltstage::tb
