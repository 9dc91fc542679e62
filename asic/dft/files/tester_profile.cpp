// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/files/tester_profile.hpp"

#include <cstdint>

#include "base/toml_file.hpp"

namespace meltstage::dft {

TesterProfile read_tester_profile(const std::filesystem::path& path) {
  constexpr std::int64_t kMostCount = 1'000'000'000'000;
  TesterProfile profile;
  const toml::table table = parse_toml(path, "a tester's profile (TOML)");
  TomlSection tester(path, &table, "");
  const auto time_ns = [&](const char* key, double fallback) {
    return tester.number(key, fallback, 1e-6, 1e9);
  };
  const auto count = [&](const char* key, std::uint64_t fallback) {
    return static_cast<std::uint64_t>(
        tester.integer(key, static_cast<std::int64_t>(fallback), 1, kMostCount));
  };
  profile.name = tester.text("name", profile.name);
  profile.least_period_ns = time_ns("least_period_ns", profile.least_period_ns);
  profile.edge_resolution_ns = time_ns("edge_resolution_ns", profile.edge_resolution_ns);
  profile.least_pulse_ns = time_ns("least_pulse_ns", profile.least_pulse_ns);
  profile.vector_memory = count("vector_memory", profile.vector_memory);
  profile.pins = count("pins", profile.pins);
  tester.finish();
  // A limit that nobody told would count as kept.
  for (const char* limit :
       {"least_period_ns", "edge_resolution_ns", "least_pulse_ns", "vector_memory", "pins"}) {
    if (!tester.has(limit)) tester.fail(limit, "nothing", "every limit of the tester in its profile");
  }
  return profile;
}

}  // namespace meltstage::dft
