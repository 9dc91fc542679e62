// SPDX-License-Identifier: Apache-2.0
// What `meltstage dft` reads and writes beside the patterns: hashes, manifests, the functional set's
// folder.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "asic/dft/scan/masks.hpp"
#include "asic/signoff/functional_vectors.hpp"

namespace meltstage::app {

// Throws UserError when it can't be read.
std::string read_file(const std::filesystem::path& path);
std::string sha256_of(const std::string& text);
// {"file": name, "sha256": hash}. Throws UserError.
nlohmann::ordered_json file_hash(const std::filesystem::path& path);
// Masked strobes, all and by reason.
nlohmann::ordered_json mask_json(const std::vector<dft::MaskedStrobes>& masked);

// What the set is meant for; empty where it isn't given.
struct FunctionalSources {
  std::filesystem::path netlist, library;
};
struct FunctionalFolder {
  std::uint64_t clocks, vectors, masked;
};
// The set in every format, masks.txt and manifest.json with the hashes of tool, RTL, sources and files. Same
// set and sources: same bytes. Throws UserError and UserError.
FunctionalFolder write_functional_set(const FunctionalSet& set, const FunctionalSources& sources,
                                      const std::filesystem::path& folder);

}  // namespace meltstage::app
