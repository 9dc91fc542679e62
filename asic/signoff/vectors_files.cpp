// SPDX-License-Identifier: Apache-2.0
#include "asic/signoff/vectors_files.hpp"

#include <nlohmann/json.hpp>

#include "asic/dft/files/formats.hpp"
#include "asic/dft/files/stil.hpp"
#include "base/build_stamp.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/sha256.hpp"
#include "recording/text.hpp"

namespace meltstage::app {

namespace fs = std::filesystem;

std::string read_file(const fs::path& path) { return meltstage::read_file(path, "an existing file"); }

std::string sha256_of(const std::string& text) {
  Sha256 hash;
  hash.update(text);
  return hash.finish();
}

nlohmann::ordered_json file_hash(const fs::path& path) {
  return {{"file", path.filename().string()}, {"sha256", sha256_of(read_file(path))}};
}

nlohmann::ordered_json mask_json(const std::vector<dft::MaskedStrobes>& masked) {
  const dft::MaskSummary sums = dft::summary(masked);
  nlohmann::ordered_json json = {{"strobes", sums.masked}, {"reasons", nlohmann::ordered_json::object()}};
  for (const auto& [reason, strobes] : sums.reasons) json["reasons"][reason] = strobes;
  return json;
}

FunctionalFolder write_functional_set(const FunctionalSet& set, const FunctionalSources& sources,
                                      const fs::path& folder) {
  nlohmann::ordered_json manifest = {{"tool", version()}, {"rtl", rtl_sha256()}};
  if (!sources.netlist.empty()) manifest["netlist"] = file_hash(sources.netlist);
  if (!sources.library.empty()) manifest["library"] = file_hash(sources.library);
  std::vector<MaskedStrobes> recorded;
  const dft::CycleStream stream = chip_cycles(set.stream, set.pieces, &recorded);
  std::vector<dft::MaskedStrobes> masked;
  for (MaskedStrobes& entry : recorded)
    masked.push_back({entry.cycle, 1, "", std::move(entry.outputs), std::move(entry.reason)});
  const FunctionalFolder result{dft::cycle_count(stream), stream.cycles.size(), dft::summary(masked).masked};
  manifest["seed"] = kFunctionalSeed;
  manifest["clocks"] = result.clocks;
  manifest["vectors"] = result.vectors;
  manifest["masked"] = mask_json(masked);
  fs::create_directories(folder);
  recording::write_text(set.stream, folder / "functional.mvec");
  manifest["files"]["functional.mvec"] = sha256_of(read_file(folder / "functional.mvec"));
  const auto write = [&](const char* name, const std::string& text) {
    write_whole(folder / name, text);
    manifest["files"][name] = sha256_of(text);
  };
  write("functional.stil", dft::flat_stil_text(stream));
  write("functional.wgl", dft::wgl_text(stream));
  write("functional.avc", dft::avc_text(stream));
  write("functional.atp", dft::atp_text(stream));
  write("masks.txt", dft::mask_text(masked));
  for (const FunctionalPiece& piece : set.pieces)
    manifest["pieces"].push_back({{"requirement", piece.requirement}, {"first_cycle", piece.first_cycle}});
  write_whole(folder / "manifest.json", manifest.dump(2) + "\n");
  return result;
}

}  // namespace meltstage::app
