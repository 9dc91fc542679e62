// SPDX-License-Identifier: Apache-2.0
#include "hls/cpp/compile.hpp"

#include <fmt/format.h>
#include <llvm/Analysis/LoopInfo.h>
#include <llvm/IR/DiagnosticInfo.h>
#include <llvm/IR/Dominators.h>
#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/InstIterator.h>
#include <llvm/IR/IntrinsicInst.h>
#include <llvm/IRReader/IRReader.h>
#include <llvm/Linker/Linker.h>
#include <llvm/Passes/PassBuilder.h>
#include <llvm/Support/CommandLine.h>
#include <llvm/Support/SourceMgr.h>

#include <iterator>
#include <mutex>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/parallel.hpp"
#include "base/temporary_folder.hpp"
#include "hls/subprocess.hpp"

namespace meltstage::hls {
namespace {

constexpr const char* kCompiler =
    "clang++-14";  // the LLVM that is linked reads only what its own version writes

// Bitcode of one file, as its author wrote it: LLVM's passes run later, on all files together.
std::string bitcode(const std::filesystem::path& file, const std::vector<std::string>& options,
                    Undefined undefined) {
  read_file(file, "a C++ file");  // the compiler would wait for a pipe, and read a device without end
  const TemporaryFolder folder;
  const std::string code = (folder.path() / "code.bc").string();
  std::vector<std::string> words = {"-std=c++20",
                                    "-O1",
                                    "-Xclang",
                                    "-disable-llvm-passes",
                                    "-gline-tables-only",
                                    "-fno-exceptions",
                                    "-fno-rtti",
                                    "-emit-llvm",
                                    "-c",
                                    file.string(),
                                    "-o",
                                    code};
  if (undefined == Undefined::kTraps)
    words.insert(
        words.end(),
        {"-fno-discard-value-names", "-fno-delete-null-pointer-checks", "-fsanitize=undefined",
         "-fsanitize-trap=all",
         "-fno-sanitize=vptr,function,alignment,null,nonnull-attribute,object-size,pointer-overflow"});
  words.insert(words.end(), options.begin(), options.end());
  const Finished compiled = run_tool(kCompiler, "clang-14", words);
  if (compiled.status != 0) {
    const std::string line = line_with(compiled.output, "error:");
    const bool ours = line.find("'hls/interface.hpp' file not found") != std::string::npos;
    throw UserError(line + (ours ? "; give --option=-I and the folder that holds hls/" : ""));
  }
  return read_file(code, "bitcode");
}

// ---- Locals that are read before they are written ---------------------------------------------------------

// Gives each local a value that nothing is known of, where it begins to be: what LLVM's passes would take as
// they like stays visible as a call of hls_open.BITS.NAME.
class OpenLocals {
 public:
  explicit OpenLocals(llvm::Module& module) : module_(module), layout_(module.getDataLayout()) {}

  void mark() {
    for (llvm::Function& function : module_) {
      if (function.isDeclaration()) continue;
      const llvm::LoopInfo loops{llvm::DominatorTree(function)};
      std::vector<llvm::AllocaInst*> locals;
      for (llvm::Instruction& instruction : llvm::instructions(function))
        if (auto* local = llvm::dyn_cast<llvm::AllocaInst>(&instruction)) locals.push_back(local);
      for (llvm::AllocaInst* local : locals)
        if (local->isStaticAlloca() && !local->isArrayAllocation()) mark(*local, loops);
    }
  }

 private:
  static constexpr std::uint64_t kMostStores = 1024;

  void mark(llvm::AllocaInst& local, const llvm::LoopInfo& loops) {
    name_ = local.hasName() ? local.getName().str() : "a local";
    const std::vector<llvm::Instruction*> starts = starts_of(local);
    for (llvm::Instruction* start : starts) open_before(*start->getNextNode(), start->getDebugLoc(), local);
    if (!starts.empty()) return;
    const llvm::DebugLoc line = first_use(local);
    const llvm::Loop* loop = loop_of_uses(local, loops);
    open_before(*local.getNextNode(), line, local);
    // One that a loop alone uses is a new one in each round.
    if (loop != nullptr) open_before(*loop->getHeader()->getFirstInsertionPt(), line, local);
  }

  // The innermost loop that has all uses of a local; nullptr if there is none.
  static const llvm::Loop* loop_of_uses(const llvm::AllocaInst& local, const llvm::LoopInfo& loops) {
    const llvm::Loop* common = nullptr;
    bool is_first = true;
    for (const llvm::User* user : local.users()) {
      const auto* instruction = llvm::dyn_cast<llvm::Instruction>(user);
      if (instruction == nullptr) continue;
      if (is_first) common = loops.getLoopFor(instruction->getParent());
      is_first = false;
      while (common != nullptr && !common->contains(instruction)) common = common->getParentLoop();
    }
    return common;
  }

  // Where its scope is entered; none for locals that a switch or goto may pass by.
  static std::vector<llvm::Instruction*> starts_of(llvm::AllocaInst& local) {
    std::vector<llvm::Instruction*> result;
    for (llvm::User* user : local.users()) {
      std::vector<llvm::User*> candidates = {user};
      if (llvm::isa<llvm::BitCastInst>(user)) candidates.assign(user->user_begin(), user->user_end());
      for (llvm::User* candidate : candidates)
        if (auto* call = llvm::dyn_cast<llvm::IntrinsicInst>(candidate))
          if (call->getIntrinsicID() == llvm::Intrinsic::lifetime_start) result.push_back(call);
    }
    return result;
  }

  // The lines of the uses say where a local is that has no line.
  static llvm::DebugLoc first_use(llvm::AllocaInst& local) {
    llvm::DebugLoc result;
    for (llvm::User* user : local.users()) {
      const auto* instruction = llvm::dyn_cast<llvm::Instruction>(user);
      if (instruction != nullptr && instruction->getDebugLoc() &&
          (!result || instruction->getDebugLoc().getLine() < result.getLine()))
        result = instruction->getDebugLoc();
    }
    return result;
  }

  void open_before(llvm::Instruction& place, const llvm::DebugLoc& line, llvm::AllocaInst& local) {
    llvm::IRBuilder<> builder(&place);
    builder.SetCurrentDebugLocation(line);
    llvm::Type* type = local.getAllocatedType();
    if (integers(type) <= kMostStores) {
      write(builder, &local, type);
    } else {
      llvm::Value* byte = open(builder, builder.getInt8Ty());
      builder.CreateMemSet(&local, byte, layout_.getTypeAllocSize(type), local.getAlign());
    }
  }

  static std::uint64_t integers(const llvm::Type* type) {
    if (const auto* array = llvm::dyn_cast<llvm::ArrayType>(type))
      return array->getNumElements() * integers(array->getElementType());
    std::uint64_t count = type->isIntegerTy() ? 1 : 0;
    if (const auto* structure = llvm::dyn_cast<llvm::StructType>(type))
      for (const llvm::Type* member : structure->elements()) count += integers(member);
    return count;
  }

  void write(llvm::IRBuilder<>& builder, llvm::Value* to, llvm::Type* type) {
    if (type->isIntegerTy()) builder.CreateStore(open(builder, type), to);
    // A pointer that nothing was written to points nowhere.
    if (type->isPointerTy())
      builder.CreateStore(llvm::ConstantPointerNull::get(llvm::cast<llvm::PointerType>(type)), to);
    const unsigned count = type->isStructTy()  ? type->getStructNumElements()
                           : type->isArrayTy() ? static_cast<unsigned>(type->getArrayNumElements())
                                               : 0;
    for (unsigned i = 0; i < count; ++i)
      write(builder, builder.CreateConstInBoundsGEP2_32(type, to, 0, i),
            type->isStructTy() ? type->getStructElementType(i) : type->getArrayElementType());
  }

  llvm::Value* open(llvm::IRBuilder<>& builder, llvm::Type* type) {
    const std::string name = fmt::format("{}{}.{}", kOpenLocal, type->getIntegerBitWidth(), name_);
    llvm::FunctionCallee function = module_.getOrInsertFunction(name, type);
    auto* declared = llvm::cast<llvm::Function>(function.getCallee());
    declared->setDoesNotThrow();
    declared->setOnlyAccessesInaccessibleMemory();
    declared->addFnAttr(llvm::Attribute::WillReturn);
    return builder.CreateCall(function);
  }

  llvm::Module& module_;
  const llvm::DataLayout& layout_;
  std::string name_;
};

// Whatever is called is copied in; memory becomes values where that is possible; loops that can be counted
// keep their form, since the translation runs through them.
constexpr const char* kPasses =
    "internalize,globaldce,globalopt,cgscc(inline),globaldce,"
    "function(sroa,early-cse<memssa>,instcombine,simplifycfg,sroa,gvn,instcombine,sccp,dse,adce,simplifycfg,"
    "loop-simplify,lcssa)";

void set_thresholds() {
  static std::once_flag once;
  std::call_once(once, [] {
    const char* words[] = {
        "hls", "-inline-threshold=100000000", "-inline-cold-callsite-threshold=100000000",
        "-internalize-public-api-list=hls_reset,hls_step,hls_outputs,hls_in_reset,hls_invariants,hls_"
        "flops,hls_input_pins,hls_output_pins,hls_invariant_names"};
    llvm::cl::ParseCommandLineOptions(std::size(words), words);
  });
}

void run_passes(llvm::Module& module) {
  set_thresholds();
  llvm::PassBuilder builder;
  llvm::LoopAnalysisManager loops;
  llvm::FunctionAnalysisManager functions;
  llvm::CGSCCAnalysisManager components;
  llvm::ModuleAnalysisManager modules;
  builder.registerModuleAnalyses(modules);
  builder.registerCGSCCAnalyses(components);
  builder.registerFunctionAnalyses(functions);
  builder.registerLoopAnalyses(loops);
  builder.crossRegisterProxies(loops, functions, components, modules);
  llvm::ModulePassManager passes;
  if (llvm::Error error = builder.parsePassPipeline(passes, kPasses))
    throw std::logic_error(llvm::toString(std::move(error)));
  passes.run(module, modules);
}

}  // namespace

std::unique_ptr<llvm::Module> compile(const Sources& sources, Undefined undefined,
                                      llvm::LLVMContext& context) {
  std::vector<std::string> codes(sources.files.size());
  in_parallel(sources.files.size(),
              [&](std::size_t i) { codes[i] = bitcode(sources.files[i], sources.options, undefined); });

  // LLVM's own handler would end the program, with another status
  context.setDiagnosticHandlerCallBack([](const llvm::DiagnosticInfo&, void*) {});
  std::unique_ptr<llvm::Module> whole;
  for (const std::string& code : codes) {
    llvm::SMDiagnostic problem;
    auto module = llvm::parseIR(llvm::MemoryBufferRef(code, "bitcode"), problem, context);
    if (!module) throw UserError(fmt::format("hls: {}", problem.getMessage().str()));
    if (!whole) {
      whole = std::move(module);
    } else if (llvm::Linker::linkModules(*whole, std::move(module))) {
      throw UserError("hls: two of the files define the same function");
    }
  }
  if (undefined == Undefined::kTraps) {
    OpenLocals(*whole).mark();
    whole->getOrInsertNamedMetadata(kShowsPromises);
  }
  run_passes(*whole);
  return whole;
}

}  // namespace meltstage::hls
