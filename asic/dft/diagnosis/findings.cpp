// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/diagnosis/findings.hpp"

#include <algorithm>
#include <set>

namespace meltstage::dft {
namespace {

// Nets of suspects that stand best first, in groups of which none is better than the other.
template <class Suspects, class IsBetter, class NetOf>
void add_groups(const Suspects& suspects, const IsBetter& is_better, const NetOf& net_of,
                std::vector<std::vector<std::string>>& groups) {
  std::set<std::string> named;
  for (std::size_t i = 0; i < suspects.size(); ++i) {
    if (i == 0 || is_better(suspects[i - 1], suspects[i])) groups.emplace_back();
    const std::string net = net_of(suspects[i]);
    if (named.insert(net).second) groups.back().push_back(net);
  }
  std::erase_if(groups, [](const auto& group) { return group.empty(); });
}

}  // namespace

LineNames::LineNames(const Circuit& circuit) : circuit_(circuit) {
  for (const Site& site : circuit.sites())
    if (site.node != kNoNode) names_.try_emplace({site.node, site.pin}, site.name);
}

std::string LineNames::of(const Line& line) const {
  const auto found = names_.find(line);
  return found != names_.end() ? found->second : circuit_.name(line.node);
}

std::string LineNames::net_of(const Line& line) const { return of({source_of(circuit_, line), kStem}); }

LogReader::LogReader(const ProgramOnNetlist& program)
    : program_(program),
      diagnoser_(program.captures.circuit, program.patterns),
      lines_(program.captures.circuit),
      of_chip_(program.view.circuit) {}

Findings LogReader::findings(const FailLog& log, const Progress& progress) const {
  const auto agrees_more = [](const ChainSuspect& a, const ChainSuspect& b) {
    return a.agreement > b.agreement;
  };
  const auto net_of_chip = [&](const ChainSuspect& s) { return of_chip_.net_of(s.defect.line); };
  Findings findings;
  const auto disagrees = [](const ChainSuspect& s) { return s.agreement < kLeastAgreement; };
  if (log.fails.empty()) return findings;
  findings.chains = diagnose_chains(program_.view, program_.stream, program_.scan_enable, log, progress);
  if (!findings.chains.empty()) {
    std::vector<ChainSuspect> all;
    for (const BrokenChain& chain : findings.chains)
      all.insert(all.end(), chain.suspects.begin(), chain.suspects.end());
    std::erase_if(all, disagrees);
    std::stable_sort(all.begin(), all.end(), agrees_more);
    add_groups(all, agrees_more, net_of_chip, findings.blamed);
    return findings;
  }
  findings.captures = diagnoser_.diagnose(log);
  for (const DefectFound& defect : findings.captures.defects)
    add_groups(
        defect.suspects, ranks_before, [&](const Suspect& s) { return lines_.net_of(s.line); },
        findings.blamed);
  if (findings.captures.failing_patterns == 0 && !program_.scan_enable.empty()) {
    findings.resets = diagnose_resets(program_.view, program_.stream, program_.scan_enable, log, progress);
    std::vector<ChainSuspect> likely = findings.resets;
    std::erase_if(likely, disagrees);
    add_groups(likely, agrees_more, net_of_chip, findings.blamed);
  }
  return findings;
}

}  // namespace meltstage::dft
