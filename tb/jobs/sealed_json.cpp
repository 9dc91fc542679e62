// SPDX-License-Identifier: Apache-2.0
#include "tb/jobs/sealed_json.hpp"

#include <optional>

#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/sha256.hpp"

namespace meltstage::tb {

namespace fs = std::filesystem;

namespace {

constexpr int kVersion = 1;

bool is_text(const Json& file, const char* key) {
  return file.is_object() && file.contains(key) && file[key].is_string();
}

// The file's JSON; nothing for what is none of this format.
std::optional<Json> json_of(const fs::path& path, const char* format) {
  const std::string text = read_file(path, "a file of a work folder; make it again");
  // What follows calls itself once a level; a plan and a result are five deep.
  bool too_deep = false;
  const auto shallow = [&](int depth, Json::parse_event_t, Json&) {
    too_deep = too_deep || depth > static_cast<int>(kMostNested);
    return !too_deep;
  };
  Json file = Json::parse(text, shallow, false);
  if (too_deep || !is_text(file, "format") || file["format"] != format) return std::nullopt;
  return file;
}

}  // namespace

std::string content_hash(const Json& content) { return sha256(content.dump()); }

void write_sealed(const fs::path& path, const char* format, const Json& content) {
  const Json file = {
      {"format", format}, {"version", kVersion}, {"content", content}, {"sha256", content_hash(content)}};
  OutputFile out(path);
  out.write(file.dump(1) + "\n");
  out.publish();
}

bool is_sealed(const fs::path& path, const char* format) { return json_of(path, format).has_value(); }

Json read_sealed(const fs::path& path, const char* format) {
  const std::optional<Json> read = json_of(path, format);
  if (!read)
    throw UserError(
        fmt::format("{}: not a file of format {}, expected JSON as this command writes it; "
                    "make it again",
                    path.string(), format));
  const Json& file = *read;
  if (!file.contains("version") || file["version"] != kVersion) {
    throw UserError(fmt::format("{}: found another version of the format, expected {}; make it again",
                                path.string(), kVersion));
  }
  const Json content = file.value("content", Json());
  const std::string said = is_text(file, "sha256") ? file["sha256"].get<std::string>() : "nothing";
  if (said != content_hash(content)) {
    throw UserError(
        fmt::format("{}: damaged: its content has SHA-256 {}..., it says {:.12}...; make it again",
                    path.string(), content_hash(content).substr(0, 12), shown(said)));
  }
  return content;
}

}  // namespace meltstage::tb
