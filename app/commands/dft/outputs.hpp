// SPDX-License-Identifier: Apache-2.0
// What subcommands of `dft` print and write: coverage, and folders with a manifest of what lies in them.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "asic/dft/core/faults.hpp"
#include "asic/dft/scan/scan.hpp"
#include "base/folder_lock.hpp"

namespace meltstage::app {

void print_coverage(const dft::Coverage& c);

/// Refuses to write into a folder in which an input lies. An empty path is no input.
void require_apart(const std::filesystem::path& folder, std::vector<std::filesystem::path> inputs);
/// Refuses a folder in which another file than one of an earlier run has one of these names.
void require_own(const std::filesystem::path& folder, std::vector<std::string> names);
/// Makes the folder, with a manifest that names these files beside those of an earlier run: what a run that
/// is ended leaves of them is its own to the next one.
/// No other run writes there for as long as the object lives; refused when one does.
class OutputClaim {
 public:
  OutputClaim(const std::filesystem::path& folder, const std::vector<std::string>& names);

 private:
  FolderLock lock_;
};

/// Files that an earlier run wrote into the folder and this one doesn't: beside the new ones they would pass
/// for theirs. What somebody has changed since stays.
void remove_earlier(const std::filesystem::path& folder, const std::map<std::string, std::string>& written);

inline constexpr const char* kManifest = "manifest.json";
/// The manifest of a folder that has nothing else to tell. `written`: hash by name.
void write_manifest(const std::filesystem::path& folder, const std::filesystem::path& netlist,
                    const std::map<std::string, std::string>& written);

/// Of a netlist with scan.
inline const std::vector<std::string> kScanFiles = {"netlist.json", "netlist.v", "cells.v", "scan.json"};
std::string scan_json(const std::filesystem::path& netlist, const dft::ScanDesign& design);

}  // namespace meltstage::app
