// SPDX-License-Identifier: Apache-2.0
// The proof refutes what is changed on one side, and the counterexample is a failing run of one clock.
//
//   refutations rtl FOLDER BUGS      FOLDER: RTL in which bug_i chooses one of BUGS (tests/proofs/mutation)
//   refutations model FOLDER CHANGES CHANGES: a line a change of cmodel/: file, text, what stands in its
//   place
//
// Each bug or change must be refuted. The counterexample is run on the Verilated RTL and on the model: with
// the bug or change both must differ after this clock, without it they must agree: bugs are chosen by bug_i,
// a changed model is built as a library. Exit status: 0 all refuted, 1 not, 2 wrong use.
#include <dlfcn.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "Vbugs.h"
#include "Vbugs__Syms.h"
#include "Vbugs___024root.h"
#include "base/error.hpp"
#include "chip_question.hpp"
#include "hls/proof/counterexample.hpp"
#include "hls/proof/refutation.hpp"
#include "tb/lockstep/verilated_top.hpp"

namespace meltstage {
namespace {

namespace fs = std::filesystem;
using tests::kChoice, tests::kChoiceBits, tests::model_in, tests::question, tests::variants_in;
namespace spec = chip::spec;  // the flop lists are written inside meltstage::chip

struct Change {
  std::string file, right, wrong, what;
};

std::vector<Change> read_changes(const fs::path& path) {
  std::vector<Change> changes;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    Change change;
    std::istringstream words(line);
    std::getline(words, change.file, '\t');
    std::getline(words, change.right, '\t');
    std::getline(words, change.wrong, '\t');
    std::getline(words, change.what, '\t');
    changes.push_back(change);
  }
  return changes;
}

std::string text_of(const fs::path& path) { return read_file(path, "a text"); }

// Every bug is chosen by bug_i.
std::optional<bool> chosen_by_pin(unsigned) { return std::nullopt; }

// ---- One clock in lockstep -------------------------------------------------------------------------------

class Variant final : public tb::verilated::VerilatedTop<Vbugs> {
 public:
  explicit Variant(unsigned number) {
    top_.bug_i = static_cast<std::uint16_t>(number);
    set_assertions(false);  // the state may be one that is never reached
  }
  chip::Outputs pins() const { return chip::take_outputs(top_); }
};

// A flop of `width` bits as the model's type.
template <class T>
T with_sign(std::uint64_t value, unsigned width) {
  const unsigned above = 64 - width;
  if constexpr (std::is_signed_v<T>)
    return static_cast<T>(static_cast<std::int64_t>(value << above) >> above);
  return static_cast<T>(value);
}

chip::Chip state_of(const hls::Counterexample& example) {
  chip::Chip chip;
  for (const hls::NamedValue& flop : example.state) {
    const auto is = [&](const std::string& instance, const std::string& name) {
      return flop.name == tb::verilated::dotted(instance) + "." + name;
    };
#define TC_FLOP(type, name, width, reset) \
  if (is(TC_TEXT1(TC_INSTANCE), #name)) chip.TC_MEMBER.name = with_sign<type>(flop.value, width);
#define TC_ARRAY(type, name, count, width)                             \
  for (unsigned word = 0; word < (count); ++word)                      \
    if (is(TC_TEXT1(TC_INSTANCE), fmt::format("{}[{}]", #name, word))) \
      chip.TC_MEMBER.name[word] = static_cast<type>(flop.value);
#include "cmodel/for_each_flop.inc"
  }
  chip.mem.refresh_params();
  return chip;
}

chip::Inputs pins_of(const hls::Counterexample& example) {
  chip::Inputs in;
  for (const hls::NamedValue& pin : example.pins) {
#define TC_TAKE(port, member, bits) \
  if (pin.name == #port) in.member = static_cast<decltype(in.member)>(pin.value);
    TC_INPUT_PINS(TC_TAKE) TC_TEST_PINS(TC_TAKE)
#undef TC_TAKE
  }
  return in;
}

// A model with one change, built and loaded.
class ChangedModel {
 public:
  explicit ChangedModel(const fs::path& root) {
    const fs::path library = root / "changed.so", messages = root / "messages.txt";
    const std::string command = fmt::format(
        "clang++-14 -std=c++20 -O1 -shared -fPIC -Wl,-Bsymbolic -I'{0}' '{0}'/cmodel/*.cpp '{1}' -lfmt -o "
        "'{2}' "
        ">'{3}' 2>&1",
        root.string(), MELTSTAGE_SOURCE_DIR "/tests/hls/changed_clock.cpp", library.string(),
        messages.string());
    if (std::system(command.c_str()) != 0)
      throw UserError(fmt::format("the changed model does not compile: {}", text_of(messages)));
    library_ = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) throw UserError(fmt::format("the changed model: {}", dlerror()));
  }
  ~ChangedModel() { dlclose(library_); }
  ChangedModel(const ChangedModel&) = delete;
  ChangedModel& operator=(const ChangedModel&) = delete;

  chip::Outputs step(chip::Chip& state, const chip::Inputs& in) const {
    chip::Outputs out;
    call<void(chip::Chip*, const chip::Inputs*, chip::Outputs*)>("changed_step")(&state, &in, &out);
    return out;
  }
  chip::Outputs outputs(const chip::Chip& state, const chip::Inputs& in) const {
    chip::Outputs out;
    call<void(const chip::Chip*, const chip::Inputs*, chip::Outputs*)>("changed_outputs")(&state, &in, &out);
    return out;
  }

 private:
  template <class Function>
  Function* call(const char* name) const {
    void* found = dlsym(library_, name);
    if (found == nullptr) throw UserError(fmt::format("the changed model: {}", dlerror()));
    return reinterpret_cast<Function*>(found);
  }

  void* library_;
};

// The model as it is.
struct GoodModel {
  static chip::Outputs step(chip::Chip& state, const chip::Inputs& in) { return state.step(in); }
  static chip::Outputs outputs(const chip::Chip& state, const chip::Inputs& in) { return state.outputs(in); }
};

// Whether RTL and model differ when they do the example's clock.
template <class Model>
bool differ_in_one_clock(const hls::Counterexample& example, unsigned bug, const Model& model) {
  const chip::Inputs in = pins_of(example);
  chip::Chip state = state_of(example);
  Variant rtl(bug);
  rtl.load(state, in);
  if (example.kind == hls::Kind::kPin) return rtl.pins() != model.outputs(state, in);
  const chip::Outputs expected = model.step(state, in);
  return rtl.step(in) != expected || !rtl.flops_equal(state);
}

// ---- Commands --------------------------------------------------------------------------------------------

class Tally {
 public:
  void add(const std::string& what, bool good, const std::optional<hls::Counterexample>& example,
           const char* problem) {
    fmt::print("{}: {}\n", what, good ? "refuted" : problem);
    if (example) fmt::print("{}", hls::to_text(*example, {"C++", "RTL"}));
    std::fflush(stdout);
    ++count_;
    refuted_ += good ? 1 : 0;
  }
  int finish() const {
    fmt::print("{} of {} refuted\n", refuted_, count_);
    return refuted_ == count_ && count_ > 0 ? 0 : 1;
  }

 private:
  unsigned count_ = 0, refuted_ = 0;
};

int refute_rtl(const fs::path& folder, const fs::path& list, std::size_t first) {
  const hls::Circuit model = model_in(MELTSTAGE_SOURCE_DIR);
  const hls::Problem all = question(model, variants_in(folder, chosen_by_pin));
  const hls::Problem proved = hls::with_pin(all, kChoice, kChoiceBits, 0);
  const std::vector<Change> changes = read_changes(list);
  Tally tally;
  for (unsigned i = 0; i < std::min(first, changes.size()); ++i) {
    const auto example = hls::refute(model, proved, hls::with_pin(all, kChoice, kChoiceBits, i + 1)).example;
    const bool runs = example && differ_in_one_clock(*example, i + 1, GoodModel{}) &&
                      !differ_in_one_clock(*example, 0, GoodModel{});
    tally.add(fmt::format("{}: {}", changes[i].file, changes[i].what), runs, example,
              example ? "FAILED: the counterexample is no failing run of one clock" : "FAILED: not refuted");
  }
  return tally.finish();
}

int refute_model(const fs::path& folder, const fs::path& list, std::size_t first) {
  const hls::Rtl rtl = variants_in(folder, [](unsigned) { return false; });
  const hls::Problem proved = question(model_in(MELTSTAGE_SOURCE_DIR), rtl);
  const std::vector<Change> changes = read_changes(list);
  const fs::path copy = fs::temp_directory_path() / fmt::format("meltstage_hls_model.{}", getpid());
  Tally tally;
  for (std::size_t i = 0; i < std::min(first, changes.size()); ++i) {
    const Change& change = changes[i];
    fs::remove_all(copy);
    fs::create_directory(copy);
    for (const char* part : {"cmodel", "hls"})
      fs::copy(fs::path(MELTSTAGE_SOURCE_DIR) / part, copy / part, fs::copy_options::recursive);
    std::string text = text_of(copy / "cmodel" / change.file);
    const std::size_t at = text.find(change.right);
    if (at == std::string::npos || text.find(change.right, at + 1) != std::string::npos)
      throw UserError(fmt::format("{}: {}: expected '{}' once; adapt the line to the model", list.string(),
                                  change.file, change.right));
    std::ofstream(copy / "cmodel" / change.file) << text.replace(at, change.right.size(), change.wrong);
    const hls::Circuit model = model_in(copy);
    const auto example = hls::refute(model, proved, question(model, rtl)).example;
    const bool runs = example && differ_in_one_clock(*example, 0, ChangedModel(copy)) &&
                      !differ_in_one_clock(*example, 0, GoodModel{});
    tally.add(fmt::format("{}: {} -> {}", change.file, change.right, change.wrong), runs, example,
              example ? "FAILED: the counterexample is no failing run of one clock" : "FAILED: not refuted");
  }
  fs::remove_all(copy);
  return tally.finish();
}

}  // namespace
}  // namespace meltstage

int main(int argc, char** argv) {
  CLI::App app("The proof that the model is the RTL refutes changes");
  app.require_subcommand(1);
  std::filesystem::path folder, list;
  std::size_t first = 1000;
  for (const char* name : {"rtl", "model"}) {
    CLI::App* command = app.add_subcommand(name);
    command->add_option("FOLDER", folder)->required();
    command->add_option("LIST", list)->required();
    command->add_option("--first", first);
  }
  CLI11_PARSE(app, argc, argv);
  try {
    return app.got_subcommand("rtl") ? meltstage::refute_rtl(folder, list, first)
                                     : meltstage::refute_model(folder, list, first);
  } catch (const meltstage::UserError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
