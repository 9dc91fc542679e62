// SPDX-License-Identifier: Apache-2.0
#include "hls/rtl/solver_formats.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/temporary_folder.hpp"
#include "hls/subprocess.hpp"

namespace meltstage::hls {

std::string for_solvers(SolverFormat format, const std::string& verilog, const std::string& module) {
  const TemporaryFolder folder;
  write_whole(folder.path() / "circuit.sv", verilog);
  write_whole(folder.path() / "write.ys",
              fmt::format("read_verilog -sv {}\nhierarchy -check -top {}\nproc\nflatten\nexpose "
                          "-dff\nasync2sync\ndffunmap\n{} {}\n",
                          (folder.path() / "circuit.sv").string(), module,
                          format == SolverFormat::kAiger ? "techmap\nopt_clean\naigmap\nwrite_aiger -symbols"
                                                         : "opt_clean\nwrite_btor",
                          (folder.path() / "circuit").string()));
  const Finished yosys = run_tool("yosys", "yosys", {"-q", "-s", (folder.path() / "write.ys").string()});
  if (yosys.status != 0)
    throw UserError(fmt::format("hls: Yosys refuses the circuit: {}", line_with(yosys.output, "ERROR")));
  return read_file(folder.path() / "circuit", "what Yosys wrote");
}

}  // namespace meltstage::hls
