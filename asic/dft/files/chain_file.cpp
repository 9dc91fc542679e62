// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/files/chain_file.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/place.hpp"

namespace meltstage::dft {

namespace {

constexpr std::string_view kWanted =
    "\"chains\", each with name, in, out and cells, as `dft scan` writes them";

void require_names(const ScanChain& chain, const std::string& file) {
  constexpr std::size_t kLongest = 4096;
  const auto check = [&](const std::string& name) {
    if (name.empty() || name.size() > kLongest)
      throw UserError(fmt::format("{}: chain {}: found a name of {} characters, expected 1 to {}", file,
                                  shown(chain.name), name.size(), kLongest));
  };
  for (const std::string* name : {&chain.name, &chain.in, &chain.out}) check(*name);
  for (const std::string& cell : chain.cells) check(cell);
}

}  // namespace

std::vector<ScanChain> read_chain_file(const std::filesystem::path& path) {
  const std::string text = read_file(path, "scan chains (JSON)");
  std::vector<ScanChain> chains;
  try {
    const auto file = nlohmann::json::parse(text);
    for (const nlohmann::json& chain : file.at("chains")) {
      chains.push_back({chain.at("name"), chain.at("in"), chain.at("out"), chain.at("cells")});
      require_names(chains.back(), path.string());
    }
  } catch (const nlohmann::json::parse_error& error) {
    throw UserError(defect_at(path.string(), place_of(text, error.byte == 0 ? 0 : error.byte - 1), "no JSON",
                              fmt::format("JSON with {}", kWanted)));
  } catch (const nlohmann::json::exception&) {
    throw UserError(fmt::format("{}: chain {}: found another shape, expected {}", path.string(),
                                chains.size() + 1, kWanted));
  }
  if (chains.empty()) throw UserError(fmt::format("{}: found no chain, expected {}", path.string(), kWanted));
  return chains;
}

}  // namespace meltstage::dft
