// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/files/chain_file.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

std::vector<ScanChain> read_chain_file(const std::filesystem::path& path) {
  std::vector<ScanChain> chains;
  try {
    const auto file = nlohmann::json::parse(read_file(path, "scan chains (JSON)"));
    for (const nlohmann::json& chain : file.at("chains"))
      chains.push_back({chain.at("name"), chain.at("in"), chain.at("out"), chain.at("cells")});
  } catch (const nlohmann::json::exception& error) {
    throw UserError(
        fmt::format("{}: found {}, expected \"chains\", each with name, in, out and cells, as `dft scan` "
                    "writes them",
                    path.string(), escaped(error.what())));
  }
  return chains;
}

}  // namespace meltstage::dft
