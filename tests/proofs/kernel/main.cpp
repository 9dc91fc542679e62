// SPDX-License-Identifier: Apache-2.0
// Proves for every state and input that rtl/tc_algor.sv and the model's kernel make the same next flops and
// outputs.
//   prove_algor FILE [--first]   FILE: the SMT-LIB 2 file that Yosys writes of the RTL (prove.sh does both);
//   --first: ends at the
//                                first difference instead of naming the others too
// Exit status: 0 proved, 1 refuted (with a counterexample), 2 wrong call, wrong file, or not decided in time.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <optional>
#include <set>
#include <unordered_map>

#include "cmodel/spec.hpp"
#include "kernel_side.hpp"
#include "rtl_side.hpp"
#include "solver_bits.hpp"

namespace meltstage::proof {
namespace {

constexpr unsigned kQuerySeconds = 120;
constexpr unsigned kStepCodes = 32;     // of step_q: all its bits can say
constexpr unsigned kProductWidth = 33;  // gain x term; narrower products stay what they are

// The same for the same expression, as long as it lives.
unsigned id_of(const z3::expr& e) { return Z3_get_ast_id(e.ctx(), e); }

// ---- Multipliers ----

// Puts an uninterpreted function in the place of every product of kProductWidth bits. What is proved with any
// function is proved with multiplication.
class MultiplierCut {
 public:
  z3::expr operator()(const z3::expr& e) {
    const unsigned id = id_of(e);
    if (const auto found = done_.find(id); found != done_.end()) return found->second;
    z3::expr result = e;
    if (e.is_app() && e.num_args() > 0) {
      z3::expr_vector args(e.ctx());
      for (unsigned i = 0; i < e.num_args(); ++i) args.push_back((*this)(e.arg(i)));
      const bool cut = e.decl().decl_kind() == Z3_OP_BMUL && e.get_sort().bv_size() == kProductWidth;
      result = cut ? product_(args) : e.decl()(args);
    }
    kept_.push_back(e);
    done_.emplace(id, result);
    return result;
  }

 private:
  z3::sort word_ = SolverBits::context().bv_sort(kProductWidth);
  z3::func_decl product_ = SolverBits::context().function("product", word_, word_, word_);
  std::unordered_map<unsigned, z3::expr> done_;
  std::vector<z3::expr> kept_;
};

// ---- One comparison ----

struct Tally {
  unsigned rewritten = 0;  // both sides became the same expression
  unsigned solved = 0;
};

struct Question {
  std::string name;  // flop or output
  z3::expr rtl;
  z3::expr kernel;
};

z3::expr at_step(z3::expr e, const z3::expr& step_q, unsigned code) {
  z3::context& c = SolverBits::context();
  z3::expr_vector from(c);
  z3::expr_vector to(c);
  from.push_back(step_q);
  to.push_back(c.bv_val(code, 5));
  return e.substitute(from, to).simplify();
}

std::optional<z3::model> difference(const z3::expr& a, const z3::expr& b) {
  z3::context& c = SolverBits::context();
  z3::solver solver(c);
  z3::params limits(c);
  limits.set("timeout", kQuerySeconds * 1000);
  solver.set(limits);
  solver.add(a != b);
  switch (solver.check()) {
    case z3::unsat:
      return std::nullopt;
    case z3::sat:
      return solver.get_model();
    default:
      throw std::runtime_error("a question is not decided: " + solver.reason_unknown());
  }
}

std::uint64_t value_in(const z3::model& model, const z3::expr& e) {
  return model.eval(e, true).get_numeral_uint64();
}

struct Counterexample {
  unsigned step;  // value of step_q
  z3::model model;
};

// A state in which the two sides differ, with true multiplication; none when they are equal at every code of
// step_q.
std::optional<Counterexample> refute(const Question& q, const z3::expr& step_q, Tally& tally) {
  MultiplierCut cut;
  const z3::expr rtl_cut = cut(q.rtl);
  const z3::expr kernel_cut = cut(q.kernel);
  std::set<std::pair<unsigned, unsigned>> asked;  // most codes ask the same
  std::vector<z3::expr> kept;
  for (unsigned code = 0; code < kStepCodes; ++code) {
    const z3::expr rtl = at_step(rtl_cut, step_q, code);
    const z3::expr kernel = at_step(kernel_cut, step_q, code);
    kept.insert(kept.end(), {rtl, kernel});
    if (!asked.insert({id_of(rtl), id_of(kernel)}).second) continue;
    if (z3::eq(rtl, kernel)) {
      ++tally.rewritten;
      continue;
    }
    ++tally.solved;
    std::optional<z3::model> model = difference(rtl, kernel);
    if (!model) continue;
    const z3::expr rtl_true = at_step(q.rtl, step_q, code);
    const z3::expr kernel_true = at_step(q.kernel, step_q, code);
    if (value_in(*model, rtl_true) == value_in(*model, kernel_true))
      model = difference(rtl_true, kernel_true);
    if (model) return Counterexample{code, *model};
  }
  return std::nullopt;
}

// ---- Counterexample ----

// Names of the free words that `e` depends on.
void collect_names(const z3::expr& e, std::set<unsigned>& seen, std::set<std::string>& names) {
  if (!seen.insert(id_of(e)).second) return;
  if (e.is_const() && e.decl().decl_kind() == Z3_OP_UNINTERPRETED) names.insert(e.decl().name().str());
  for (unsigned i = 0; i < e.num_args(); ++i) collect_names(e.arg(i), seen, names);
}

void print_counterexample(const Question& q, const Counterexample& found, const RtlSide& rtl,
                          const z3::expr& step_q) {
  const auto& [code, model] = found;
  std::set<unsigned> seen;
  std::set<std::string> involved{"step_q"};
  collect_names(at_step(q.rtl, step_q, code), seen, involved);
  collect_names(at_step(q.kernel, step_q, code), seen, involved);

  Words<std::uint64_t> state;
  std::string flops;
  std::string inputs;
  for (const auto& [name, word] : rtl.before) {
    state[name] = name == "step_q" ? code : value_in(model, word);
    std::set<unsigned> seen_here;
    std::set<std::string> parts;
    collect_names(word, seen_here, parts);
    bool shown = false;
    for (const std::string& part : parts) shown = shown || involved.contains(part);
    if (!shown) continue;
    const bool pin = name.ends_with("_i") || name.starts_with("params_i");
    std::string label = name;
    for (unsigned r = 0; r < chip::spec::kHoldingCount; ++r) {
      if (name == register_name(r)) label = chip::spec::kHolding[r].name;
    }
    (pin ? inputs : flops) += fmt::format(" {}={:#x}", label, state[name]);
  }
  const std::uint64_t by_rtl = value_in(model, at_step(q.rtl, step_q, code));
  const std::uint64_t by_kernel = value_in(model, at_step(q.kernel, step_q, code));
  const std::uint64_t by_integers = kernel_clock(state).at(q.name);
  fmt::print("counterexample: {} {}, step_q = {}\n", q.name,
             q.name.ends_with("_o") ? "(output, same clock)" : "(flop, after the clock)", code);
  fmt::print("  flops    {}\n  inputs   {}\n  what isn't listed does not matter\n", flops, inputs);
  fmt::print("  RTL      {:#x} ({})\n  kernel   {:#x} ({})\n", by_rtl, by_rtl, by_kernel, by_kernel);
  fmt::print("  kernel on plain integers, run again from this state: {:#x}, {}\n", by_integers,
             by_integers == by_kernel ? "as the solver says"
                                      : "NOT what the solver says: one of the two instantiations is wrong");
}

// ---- All of them ----

// Flops in reset: the list of the model against the RTL.
unsigned compare_reset(const RtlSide& rtl, const std::vector<FlopWord>& flops) {
  unsigned wrong = 0;
  for (const FlopWord& flop : flops) {
    for (const std::string when : {"", " after reset"}) {
      const z3::expr value = rtl.in_reset.at(flop.name + when);
      if (value.is_numeral() && value.get_numeral_uint64() == flop.reset) continue;
      fmt::print("{}{}: RTL {}, model {:#x}\n", flop.name, when.empty() ? " in reset" : when,
                 value.to_string(), flop.reset);
      ++wrong;
    }
  }
  return wrong;
}

std::vector<Question> questions(const RtlSide& rtl) {
  const Words<z3::expr> kernel = kernel_clock(rtl.before);
  std::vector<Question> all;
  for (const FlopWord& flop : flop_words()) {
    const std::string name = idle_name(flop.name);
    all.push_back({name, rtl.before.at(flop.name), kernel.at(name)});
  }
  for (const auto& [name, word] : rtl.after) {
    if (!kernel.contains(name)) throw std::runtime_error(name + ": the RTL has it, the kernel not");
    all.push_back({name, word, kernel.at(name)});
  }
  if (all.size() != kernel.size()) throw std::runtime_error("the kernel has outputs that the RTL has not");
  return all;
}

int prove(const std::string& path, bool all_differences) {
  const auto start = std::chrono::steady_clock::now();
  const std::vector<FlopWord> flops = flop_words();
  const RtlSide rtl = load_rtl(path, flops);
  const z3::expr step_q = rtl.before.at("step_q");
  unsigned wrong = compare_reset(rtl, flops);
  if (wrong != 0 && !all_differences) return 1;
  Tally tally;
  const std::vector<Question> all = questions(rtl);
  for (const Question& q : all) {
    const std::optional<Counterexample> found = refute(q, step_q, tally);
    if (!found) continue;
    if (++wrong == 1) {
      print_counterexample(q, *found, rtl, step_q);
      if (!all_differences) return 1;
    } else {
      fmt::print("differs too: {}\n", q.name);
    }
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  fmt::print(
      "{}: {} flops, {} outputs, {} flops in reset and while idle; all {} codes of step_q; {} different "
      "questions, "
      "{} equal by rewriting, {} by the solver; {:.1f} s\n",
      wrong == 0 ? "proved" : "REFUTED", flops.size(), all.size() - 2 * flops.size(), flops.size(),
      kStepCodes, tally.rewritten + tally.solved, tally.rewritten, tally.solved, seconds);
  return wrong == 0 ? 0 : 1;
}

}  // namespace
}  // namespace meltstage::proof

int main(int argc, char** argv) {
  const std::string option = argc == 3 ? argv[2] : "";
  if (argc < 2 || argc > 3 || (argc == 3 && option != "--first")) {
    fmt::print(stderr, "prove_algor: expected FILE [--first], FILE being the SMT-LIB 2 file of tc_algor\n");
    return 2;
  }
  try {
    return meltstage::proof::prove(argv[1], option.empty());
  } catch (const z3::exception& e) {
    fmt::print(stderr, "prove_algor: {}: {}\n", argv[1], e.msg());
  } catch (const std::exception& e) {
    fmt::print(stderr, "prove_algor: {}\n", e.what());
  }
  return 2;
}
