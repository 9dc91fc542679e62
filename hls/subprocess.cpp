// SPDX-License-Identifier: Apache-2.0
#include "hls/subprocess.hpp"

#include <fmt/format.h>
#include <llvm/Support/Program.h>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/temporary_folder.hpp"

namespace meltstage::hls {

Finished run_tool(const std::string& program, const std::string& package,
                  const std::vector<std::string>& arguments) {
  const auto found = llvm::sys::findProgramByName(program);
  if (!found)
    throw UserError(fmt::format("{}: found no such program, expected it installed: apt-get install {}",
                                program, package));
  const TemporaryFolder folder;
  const std::string said = (folder.path() / "said").string();
  // It ends when this program does, however that ends.
  const auto guard = llvm::sys::findProgramByName("setpriv");
  if (!guard)
    throw UserError("setpriv: found no such program, expected it installed: apt-get install util-linux");
  const std::string temporary =
      "TMPDIR=" + folder.path().string();  // what the tool leaves goes with the folder
  std::vector<llvm::StringRef> words = {"setpriv", "--pdeathsig", "KILL", "env", temporary, *found};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const llvm::Optional<llvm::StringRef> streams[] = {llvm::StringRef(""), llvm::StringRef(said),
                                                     llvm::StringRef(said)};
  const int status = llvm::sys::ExecuteAndWait(*guard, words, llvm::None, streams);
  return {status, read_file(said, "what a tool said")};
}

std::string line_with(const std::string& output, const std::string& word) {
  const std::size_t at = output.find(word);
  const std::size_t end = output.find_last_not_of('\n');
  if (end == std::string::npos) return "";
  const std::size_t in = at == std::string::npos ? end : at;
  const std::size_t start = output.rfind('\n', in);
  const std::size_t first = start == std::string::npos ? 0 : start + 1;
  return output.substr(first, output.find('\n', in) - first);
}

}  // namespace meltstage::hls
