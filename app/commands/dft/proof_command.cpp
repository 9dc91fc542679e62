// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "app/commands/dft/inputs.hpp"
#include "app/commands/dft/outputs.hpp"
#include "app/commands/dft/subcommands.hpp"
#include "asic/dft/atpg/proof_check.hpp"
#include "asic/dft/atpg/test_solver.hpp"
#include "asic/dft/program.hpp"
#include "asic/signoff/vectors_files.hpp"
#include "base/output_file.hpp"
#include "base/terminal.hpp"

namespace meltstage::app {

namespace {

namespace fs = std::filesystem;
using namespace dft;

struct ProveInput : NetlistInput {
  GenerationInput generation;
  fs::path out;
};

struct CheckProofInput {
  fs::path cnf, proof;
};

ProofFile proof_file(const fs::path& path) { return {path.string(), read_file(path)}; }

// Names of proofs that lie in the folder already, whoever wrote them.
std::vector<std::string> proofs_in(const fs::path& folder) {
  std::vector<std::string> names;
  if (!fs::is_directory(folder)) return names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    if (name.string().starts_with("class") && (name.extension() == ".cnf" || name.extension() == ".drat"))
      names.push_back(name.string());
  }
  return names;
}

int prove(const ProveInput& input) {
  require_apart(input.out, {input.netlist, input.liberty});
  std::vector<std::string> names = proofs_in(input.out);
  names.emplace_back("index.txt");
  require_own(input.out, names);
  const CellLibrary library = library_of(input);
  const TestSubject subject = test_subject(input.netlist, library, scan_of(input.generation.scan));
  ProgressLine line;
  const TestSet set = generate_tests(subject.circuit, generation_of(input.generation, line));
  for (std::size_t c = 0; c < set.of_class.size(); ++c)
    if (set.of_class[c] == FaultClass::UR)
      for (const char* ending : {".cnf", ".drat"}) names.push_back(fmt::format("class{}{}", c, ending));
  const OutputClaim claim(input.out, names);
  TestSolver solver(subject.circuit);
  std::size_t proved = 0, refused = 0;
  std::set<std::uint32_t> done;
  std::string index;
  std::map<std::string, std::string> written;
  for (std::size_t f = 0; f < set.faults.total(); ++f) {
    tell(shown_on(line), "proving", f, set.faults.total());
    const std::uint32_t c = set.faults.class_of[f];
    if (c == FaultList::kNoClass || set.of_class[c] != FaultClass::UR) continue;
    const std::string name = fmt::format("class{}", c);
    index += fmt::format("{} {}\n", name, fault_name(subject.circuit, f));
    if (!done.insert(c).second) continue;  // an equivalent fault had it
    std::string reason;
    const bool good =
        solver.prove_untestable(set.faults.classes[c], input.out, name) &&
        refutes(proof_file(input.out / (name + ".cnf")), proof_file(input.out / (name + ".drat")), reason);
    for (const std::string& file : {name + ".cnf", name + ".drat"}) {
      if (fs::exists(input.out / file)) written[file] = sha256_of(read_file(input.out / file));
    }
    ++(good ? proved : refused);
    if (!good) fmt::print("{}: {}\n", name, reason.empty() ? "not refuted" : reason);
  }
  line.clear();
  write_whole(input.out / "index.txt", index);
  written["index.txt"] = sha256_of(index);
  write_manifest(input.out, input.netlist, written);
  fmt::print("{} classes proved untestable, {} refused\n", proved, refused);
  return refused == 0 ? 0 : 1;
}

int check_proof(const CheckProofInput& input) {
  std::string reason;
  const bool good = refutes(proof_file(input.cnf), proof_file(input.proof), reason);
  fmt::print("{}\n", good ? "verified" : "refused: " + reason);
  return good ? 0 : 1;
}

}  // namespace

Action add_prove_command(CLI::App& dft) {
  auto input = std::make_shared<ProveInput>();
  CLI::App* sub = dft.add_subcommand("prove", "A checked refutation for every fault called redundant");
  show_example(sub, "dft prove netlist.json --liberty cells.lib --out proofs");
  netlist_options_of(*sub, *input, kCellsOrBench);
  generation_options_of(*sub, input->generation);
  sub->add_option("--out", input->out, "Folder for .cnf and .drat")->required();
  return [=] { return prove(*input); };
}

Action add_check_proof_command(CLI::App& dft) {
  auto input = std::make_shared<CheckProofInput>();
  CLI::App* sub = dft.add_subcommand("check-proof", "Check one refutation");
  show_example(sub, "dft check-proof fault.cnf fault.drat");
  sub->add_option("CNF", input->cnf, "DIMACS file")->required();
  sub->add_option("PROOF", input->proof, "DRAT file in text")->required();
  return [=] { return check_proof(*input); };
}

}  // namespace meltstage::app
