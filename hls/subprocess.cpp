// SPDX-License-Identifier: Apache-2.0
#include "hls/subprocess.hpp"

#include <fmt/format.h>
#include <llvm/ADT/SmallString.h>
#include <llvm/Support/FileSystem.h>
#include <llvm/Support/Program.h>

#include "base/error.hpp"
#include "base/file.hpp"

namespace meltstage::hls {

TemporaryFolder::TemporaryFolder() {
  llvm::SmallString<128> path;
  if (llvm::sys::fs::createUniqueDirectory("meltstage-hls", path))
    throw UserError(
        "a temporary folder can't be made, expected room in the folder of temporary files; name another by "
        "TMPDIR");
  path_ = path.str().str();
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;  // nothing depends on it
  std::filesystem::remove_all(path_, ignored);
}

Finished run_tool(const std::string& program, const std::string& package,
                  const std::vector<std::string>& arguments) {
  const auto found = llvm::sys::findProgramByName(program);
  if (!found)
    throw UserError(fmt::format("{}: found no such program, expected it installed: apt-get install {}",
                                program, package));
  const TemporaryFolder folder;
  const std::string said = folder.file("said").string();
  std::vector<llvm::StringRef> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const llvm::Optional<llvm::StringRef> streams[] = {llvm::StringRef(""), llvm::StringRef(said),
                                                     llvm::StringRef(said)};
  const int status = llvm::sys::ExecuteAndWait(*found, words, llvm::None, streams);
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
