// SPDX-License-Identifier: Apache-2.0
#include "app/commands/dft/outputs.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "asic/signoff/vectors_files.hpp"
#include "base/build_stamp.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;

// Names and hashes of what an earlier run wrote into the folder, by its manifest.
std::map<std::string, std::string> earlier_files(const fs::path& folder) {
  std::map<std::string, std::string> files;
  if (!fs::is_regular_file(folder / kManifest)) return files;
  const nlohmann::json json = nlohmann::json::parse(read_file(folder / kManifest), nullptr, false);
  if (!json.is_object() || !json.contains("tool") || !json.contains("files") || !json["files"].is_object())
    return files;
  for (const auto& [name, hash] : json["files"].items()) {
    if (hash.is_string()) files[name] = hash;
  }
  files[kManifest] = "";
  return files;
}

}  // namespace

void print_coverage(const dft::Coverage& c) {
  using dft::FaultClass;
  for (const FaultClass k : {FaultClass::DS, FaultClass::DI, FaultClass::PT, FaultClass::UT, FaultClass::UR,
                             FaultClass::AU, FaultClass::NC, FaultClass::NO})
    fmt::print("{:<22} {:>10}\n", to_string(k), c.of(k));
  fmt::print("{:<22} {:>10}\n{:<22} {:>10}\n", "faults", c.total(), "collapsed", c.collapsed);
  fmt::print("{:<22} {:>9.2f} %\n{:<22} {:>9.2f} %\n{:<22} {:>9.2f} %\n", "test coverage",
             100 * c.test_coverage(), "fault coverage", 100 * c.fault_coverage(), "fault efficiency",
             100 * c.fault_efficiency());
}

std::string scan_json(const fs::path& netlist, const dft::ScanDesign& design) {
  nlohmann::ordered_json json = {
      {"tool", version()},
      {"netlist", {{"file", netlist.filename().string()}, {"sha256", sha256_of(read_file(netlist))}}},
      {"clock", design.clock},
      {"reset", design.reset},
      {"test_mode", design.test_mode},
      {"scan_enable", design.scan_enable}};
  for (const dft::ScanChain& chain : design.chains)
    json["chains"].push_back(
        {{"name", chain.name}, {"in", chain.in}, {"out", chain.out}, {"cells", chain.cells}});
  return json.dump(2) + "\n";
}

void require_apart(const fs::path& folder, std::vector<fs::path> inputs) {
  std::erase_if(inputs, [](const fs::path& path) { return path.empty(); });
  require_outside(folder, inputs);
}

void require_own(const fs::path& folder, std::vector<std::string> names) {
  names.emplace_back(kManifest);
  if (fs::exists(fs::symlink_status(folder)) && !fs::is_directory(folder))
    throw UserError(
        folder.string() +
        ": found what is no folder, expected the name of a folder to write; choose another --out");
  const std::map<std::string, std::string> earlier = earlier_files(folder);
  for (const std::string& name : names) {
    if (fs::exists(fs::symlink_status(folder / name)) && earlier.count(name) == 0)
      throw UserError((folder / name).string() +
                      ": was not written by an earlier run (manifest.json), and would be replaced; choose "
                      "another --out, or move it away");
  }
}

namespace {

const fs::path& made(const fs::path& folder) {
  fs::create_directories(folder);
  return folder;
}

}  // namespace

OutputClaim::OutputClaim(const fs::path& folder, const std::vector<std::string>& names)
    : lock_(made(folder)) {
  nlohmann::ordered_json manifest = {{"tool", version()}};
  std::map<std::string, std::string> files = earlier_files(folder);
  for (const std::string& name : names) files.emplace(name, "");
  for (const auto& [name, hash] : files)
    if (name != kManifest) manifest["files"][name] = hash;
  write_whole(folder / kManifest, manifest.dump(2) + "\n");
}

void remove_earlier(const fs::path& folder, const std::map<std::string, std::string>& written) {
  for (const auto& [name, hash] : earlier_files(folder)) {
    const fs::path file = folder / name;
    if (written.count(name) != 0 || fs::path(name) != fs::path(name).filename() || !fs::is_regular_file(file))
      continue;
    if (hash == sha256_of(read_file(file))) fs::remove(file);
  }
}

void write_manifest(const fs::path& folder, const fs::path& netlist,
                    const std::map<std::string, std::string>& written) {
  remove_earlier(folder, written);
  nlohmann::ordered_json manifest = {
      {"tool", version()},
      {"netlist", {{"file", netlist.filename().string()}, {"sha256", sha256_of(read_file(netlist))}}}};
  for (const auto& [name, hash] : written) manifest["files"][name] = hash;
  write_whole(folder / kManifest, manifest.dump(2) + "\n");
}

}  // namespace meltstage::app
