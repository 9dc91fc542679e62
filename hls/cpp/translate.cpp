// SPDX-License-Identifier: Apache-2.0
#include "hls/cpp/translate.hpp"

#include <fmt/format.h>
#include <llvm/IR/Constants.h>
#include <llvm/IR/DebugInfoMetadata.h>
#include <llvm/IR/DerivedTypes.h>
#include <llvm/IR/GlobalVariable.h>

#include <map>
#include <memory>
#include <regex>
#include <set>
#include <tuple>

#include "base/error.hpp"
#include "hls/cpp/compile.hpp"
#include "hls/cpp/execution.hpp"
#include "hls/cpp/findings.hpp"
#include "hls/cpp/memory.hpp"
#include "hls/graph/names.hpp"

namespace meltstage::hls {
namespace {

// The rows of a table.
std::vector<Field> fields(const llvm::Module& module, const std::string& name) {
  const llvm::GlobalVariable* table = module.getGlobalVariable(name);
  if (table == nullptr || !table->hasInitializer())
    throw UserError(fmt::format("{}: found no table {}, expected one (hls/interface.hpp)",
                                module.getSourceFileName(), name));
  std::vector<Field> result;
  const llvm::Constant* rows = table->getInitializer();
  while (rows->getType()->isStructTy() && rows->getType()->getStructNumElements() == 1)
    rows = rows->getAggregateElement(0U);  // an std::array
  for (unsigned i = 0; rows->getAggregateElement(i) != nullptr; ++i) {
    const llvm::Constant* row = rows->getAggregateElement(i);
    const auto number = [&](unsigned column) {
      const auto* cell = llvm::dyn_cast_or_null<llvm::ConstantInt>(row->getAggregateElement(column));
      return cell == nullptr ? 0 : cell->getZExtValue();
    };
    APInt offset(64, 0);
    const auto* text =
        llvm::dyn_cast<llvm::GlobalVariable>(row->getAggregateElement(0U)->stripAndAccumulateConstantOffsets(
            module.getDataLayout(), offset, true));
    const auto* letters =
        text == nullptr ? nullptr : llvm::dyn_cast<llvm::ConstantDataArray>(text->getInitializer());
    if (letters == nullptr || !letters->isCString())
      throw UserError(
          fmt::format("{}: {}[{}]: found no name, expected a string", module.getSourceFileName(), name, i));
    Field field{.name = std::regex_replace(letters->getAsCString().str(), std::regex("__DOT__"), "."),
                .offset = static_cast<unsigned>(number(1)),
                .bytes = static_cast<unsigned>(number(2)),
                .width = static_cast<unsigned>(number(3)),
                .is_signed = number(4) != 0,
                .kept = APInt()};
    if (field.width < 1 || field.width > 8 * field.bytes)
      throw UserError(fmt::format("{}: {}: found {} bits, expected 1 to {}", module.getSourceFileName(),
                                  field.name, field.width, 8 * field.bytes));
    field.kept = APInt(64, number(5)).zextOrTrunc(field.width);
    if (const auto word = static_cast<std::int32_t>(number(6)); word >= 0)
      field.name += fmt::format("[{}]", word);
    result.push_back(std::move(field));
  }
  return result;
}

class Translation {
 public:
  explicit Translation(llvm::Module& module) : module_(module) {}

  Circuit run() {
    Graph& graph = circuit_.graph;
    const std::vector<Field> flops = fields(module_, "hls_flops");
    const std::vector<Field> inputs = fields(module_, "hls_input_pins");
    const std::vector<Field> outputs = fields(module_, "hls_output_pins");

    require_names(flops, inputs, outputs);
    require_own_bytes(flops, "hls_flops", "hls_step", 0);
    require_own_bytes(inputs, "hls_input_pins", "hls_step", 1);
    require_own_bytes(outputs, "hls_output_pins", "hls_outputs", 2);

    const Memory in_reset = call("hls_reset", {unknown("hls_reset", 0)});
    for (const Field& field : flops) {
      const Node reset = graph.slice(read(*in_reset[0], field), 0, field.width);
      if (!graph.is_constant(reset))
        throw UserError(fmt::format("{}: hls_reset(): found no value for {}, expected a constant",
                                    module_.getSourceFileName(), field.name));
      circuit_.flops.push_back({field, graph.input(field.name, field.width), 0, graph.value(reset)});
    }
    for (const Field& field : inputs)
      circuit_.inputs.push_back({field, graph.input(field.name, field.width)});

    const auto state = unknown("hls_step", 0);
    for (const Flop& flop : circuit_.flops) {
      const Node fixed = graph.constant(flop.reset & ~flop.field.kept);
      const Node moving = graph.both(flop.now, graph.constant(flop.field.kept));
      write(*state, flop.field, graph.either(moving, fixed));
    }
    const auto pins = unknown("hls_step", 1);
    for (const Pin& pin : circuit_.inputs) write(*pins, pin.field, pin.node);

    const Memory after = call("hls_step", {state, pins});
    require_unchanged("hls_step", 1, *pins, *after[1]);
    for (Flop& flop : circuit_.flops) flop.next = taken(*after[0], flop.field, &flop);
    if (module_.getFunction("hls_invariants") != nullptr) take_invariants(in_reset[0], state, after[0]);
    if (module_.getFunction("hls_in_reset") != nullptr) {
      const Memory told = call("hls_in_reset", {state, pins, unknown("hls_in_reset", 2)});
      require_unchanged("hls_in_reset", 0, *state, *told[0]);
      require_unchanged("hls_in_reset", 1, *pins, *told[1]);
      circuit_.in_reset = graph.slice(told[2]->at(0).of, 8 * told[2]->at(0).index, 1);
    }
    const Memory shown = call("hls_outputs", {state, pins, unknown("hls_outputs", 2)});
    require_unchanged("hls_outputs", 0, *state, *shown[0]);
    require_unchanged("hls_outputs", 1, *pins, *shown[1]);
    for (const Field& field : outputs) circuit_.outputs.push_back({field, taken(*shown[2], field, nullptr)});
    const std::vector<Node> results = all_results();
    refuse_unlisted(results);
    if (module_.getNamedMetadata(kShowsPromises) != nullptr) promise_that_open_values_are_unused(results);
    return std::move(circuit_);
  }

 private:
  // What a function is only to read: that it changes it would be lost.
  void require_unchanged(const char* name, unsigned argument, const Object& before, const Object& after) {
    for (std::size_t i = 0; i < before.size(); ++i)
      if (before[i].of != after[i].of || before[i].index != after[i].index)
        throw UserError(fmt::format(
            "{}: {}(): found a write to byte {} of its argument {}, expected a function that only reads it",
            function_place(function(name)), name, i, argument + 1));
  }

  // "FILE:LINE", where the compiler tells the line.
  std::string function_place(const llvm::Function& of) const {
    const llvm::DISubprogram* told = of.getSubprogram();
    return told == nullptr ? module_.getSourceFileName()
                           : fmt::format("{}:{}", told->getFilename().str(), told->getLine());
  }

  // Rows of a table lie in the struct that an argument of a function points to, each in bytes of its own.
  void require_own_bytes(const std::vector<Field>& rows, const char* table, const std::string& name,
                         unsigned argument) {
    const std::size_t size = unknown(name, argument)->size();
    std::map<unsigned, std::string> owners;
    for (const Field& field : rows) {
      for (unsigned byte = field.offset; byte < field.offset + field.bytes; ++byte) {
        if (byte >= size)
          refuse_row(table, fmt::format("found {} in byte {} of a struct of {} bytes, expected it within",
                                        field.name, byte, size));
        const auto [owner, is_first] = owners.try_emplace(byte, field.name);
        if (!is_first)
          refuse_row(table, fmt::format("found {} in bytes of {}, expected bytes of its own", field.name,
                                        owner->second));
      }
    }
  }

  // Names of blocks and of what is in them, a dot between two; Verilog's own $ is for its tasks.
  static bool has_whole_parts(const std::string& name) {
    return !name.starts_with('.') && !name.ends_with('.') && name.find("..") == std::string::npos &&
           name.find('$') == std::string::npos && name != "clk_i";
  }

  // Flops and pins stand side by side in the RTL, words and bits of them too.
  void require_names(const std::vector<Field>& flops, const std::vector<Field>& inputs,
                     const std::vector<Field>& outputs) const {
    std::set<std::string> known{"clk_i"};
    const auto take = [&](const char* table, const std::string& name) {
      if (!known.insert(name).second)
        refuse_row(table, fmt::format("found {} twice, expected each name once", name));
    };
    for (const auto& [table, rows] : {std::pair("hls_flops", &flops), std::pair("hls_input_pins", &inputs),
                                      std::pair("hls_output_pins", &outputs)}) {
      for (const Field& field : *rows) {
        if (!can_be_escaped(field.name) || !has_whole_parts(field.name))
          refuse_row(table, fmt::format("found the name '{}', expected letters, digits and _, and not clk_i",
                                        field.name));
        take(table, field.name);
        for (unsigned bit = 0; field.width > 1 && bit < field.width; ++bit)
          take(table, fmt::format("{}[{}]", field.name, bit));
        if (field.name == "rst_ni" && (rows != &inputs || field.width != 1))
          refuse_row(table,
                     fmt::format("found rst_ni of {} bits, expected 1 in hls_input_pins", field.width));
      }
    }
    for (const Field& field : flops)  // a block is known by its name, too
      for (std::size_t dot = field.name.find('.'); dot != std::string::npos;
           dot = field.name.find('.', dot + 1))
        if (known.contains(field.name.substr(0, dot)))
          refuse_row("hls_flops", fmt::format("found {} in {}, which is a flop or pin, expected a block",
                                              field.name, field.name.substr(0, dot)));
  }

  [[noreturn]] void refuse_row(const char* table, const std::string& what) const {
    throw UserError(fmt::format("{}: {}: {}", module_.getSourceFileName(), table, what));
  }

  std::vector<Node> all_results() const {
    std::vector<Node> result;
    for (const Flop& flop : circuit_.flops) result.push_back(flop.next);
    for (const Pin& pin : circuit_.outputs) result.push_back(pin.node);
    for (const Invariant& invariant : circuit_.invariants) {
      result.push_back(invariant.now);
      result.push_back(invariant.next);
    }
    if (circuit_.in_reset) result.push_back(*circuit_.in_reset);
    return result;
  }

  // A byte of a struct that no row of a table gives a value, though a result rests on it.
  void refuse_unlisted(const std::vector<Node>& results) const {
    const Graph& graph = circuit_.graph;
    const std::vector<bool> needed = graph.behind(results);
    for (Node node = 0; node < needed.size(); ++node) {
      const auto byte = bytes_.find(node);
      if (!needed[node] || byte == bytes_.end()) continue;
      if (!opens_.reads.contains(node) && !is_result(byte->second)) continue;
      const auto& [function, argument, type, at] = byte->second;
      const std::string member = member_at(*type, at);
      if (is_result(byte->second))
        throw UserError(fmt::format("{}: {}(): found {} left without a value, expected one on every path",
                                    module_.getSourceFileName(), function, member));
      refuse(opens_.reads.at(node),
             fmt::format("found {} read, which is in no row of {}, expected one for all that keeps its value",
                         member, argument == 0 ? "hls_flops" : "hls_input_pins"));
    }
  }

  // State of 2 bytes at offset 6: a member has no name here.
  std::string member_at(llvm::Type& whole, std::uint64_t byte) const {
    const llvm::DataLayout& layout = module_.getDataLayout();
    llvm::Type* type = &whole;
    std::uint64_t offset = 0;
    while (auto* structure = llvm::dyn_cast<llvm::StructType>(type)) {
      const llvm::StructLayout& members = *layout.getStructLayout(structure);
      const unsigned member = members.getElementContainingOffset(byte - offset);
      offset += members.getElementOffset(member);
      type = structure->getElementType(member);
    }
    const std::uint64_t bytes = layout.getTypeAllocSize(type);
    const llvm::StringRef name = whole.isStructTy() ? whole.getStructName() : "";
    return fmt::format("{} of {} byte{} at offset {}", name.substr(name.find('.') + 1).str(), bytes,
                       bytes == 1 ? "" : "s", offset);
  }

  // Locals may hold anything before they are written, so no result may change with them.
  void promise_that_open_values_are_unused(const std::vector<Node>& results) {
    Graph& graph = circuit_.graph;
    const std::vector<bool> needed = graph.behind(results);
    Node kept = graph.truth(true);  // all that is promised so far
    for (const Promise& promise : circuit_.promises) kept = graph.both(kept, graph.invert(promise.broken));
    std::map<std::tuple<std::string, unsigned, std::string>, std::vector<const Open*>> groups;
    for (const Open& open : opens_.values)
      if (needed[open.node]) groups[{open.place.file, open.place.line, open.of}].push_back(&open);
    for (const auto& [key, group] : groups) {
      std::unordered_map<Node, Node> others;
      for (const Open* open : group) others[open->node] = graph.any(graph.width(open->node));
      const std::vector<Node> changed = graph.replaced(results, others);
      Node broken = graph.truth(false);
      for (std::size_t i = 0; i < results.size(); ++i)
        broken = graph.either(broken, graph.invert(graph.binary(Op::kEqual, results[i], changed[i])));
      circuit_.promises.push_back({graph.both(kept, broken),
                                   fmt::format("{} is read before it is written", group[0]->of),
                                   group[0]->place});
    }
  }

  void take_invariants(const std::shared_ptr<const Object>& in_reset,
                       const std::shared_ptr<const Object>& now, const std::shared_ptr<const Object>& after) {
    Graph& graph = circuit_.graph;
    const auto hold = [&](const std::shared_ptr<const Object>& state) {
      const Memory told = call("hls_invariants", {state, unknown("hls_invariants", 1)});
      require_unchanged("hls_invariants", 0, *state, *told[0]);
      return *told[1];
    };
    const Object at_first = hold(in_reset), at_present = hold(now), at_last = hold(after);
    for (const Field& field : fields(module_, "hls_invariant_names")) {
      const auto bit = [&](const Object& object) { return graph.slice(read(object, field), 0, 1); };
      const Node first = bit(at_first);
      if (!graph.is_constant(first) || graph.value(first).isZero())
        throw UserError(fmt::format("{}: invariant {}: found it broken in reset, expected it to hold there",
                                    module_.getSourceFileName(), field.name));
      circuit_.invariants.push_back({field.name, bit(at_present), bit(at_last)});
    }
  }

  // The struct that an argument of a function points to, with nothing known of it.
  std::shared_ptr<Object> unknown(const std::string& name, unsigned argument) {
    llvm::Type* type = function(name).getArg(argument)->getType()->getPointerElementType();
    auto object = std::make_shared<Object>();
    if (!type->isSized())
      throw UserError(
          fmt::format("{}: {}(): found a struct of unknown size", module_.getSourceFileName(), name));
    for (std::uint64_t i = 0; i < module_.getDataLayout().getTypeAllocSize(type); ++i) {
      object->push_back({circuit_.graph.any(8), 0});
      bytes_[object->back().of] = {name, argument, type, i};
    }
    return object;
  }

  // One of those of interface.hpp.
  llvm::Function& function(const std::string& name) {
    const unsigned pointers = name == "hls_reset"                               ? 1
                              : name == "hls_outputs" || name == "hls_in_reset" ? 3
                                                                                : 2;
    llvm::Function* result = module_.getFunction(name);
    if (result == nullptr || result->isDeclaration())
      throw UserError(
          fmt::format("{}: found no function {}(), expected one with C linkage (hls/interface.hpp)",
                      module_.getSourceFileName(), name));
    bool fits = result->arg_size() == pointers && result->getReturnType()->isVoidTy();
    for (const llvm::Argument& argument : result->args()) fits = fits && argument.getType()->isPointerTy();
    if (!fits)
      throw UserError(
          fmt::format("{}: {}(): found other arguments or a result, expected {} pointers to structs and void",
                      module_.getSourceFileName(), name, pointers));
    return *result;
  }

  Memory call(const std::string& name, Memory arguments) {
    return execute(circuit_.graph, circuit_.promises, opens_, function(name), std::move(arguments));
  }

  void write(Object& object, const Field& field, Node value) {
    const Node whole = field.is_signed ? circuit_.graph.sign_extend(value, 8 * field.bytes)
                                       : circuit_.graph.zero_extend(value, 8 * field.bytes);
    store(circuit_.graph, object, field.offset, whole);
  }

  Node read(const Object& object, const Field& field) {
    Graph& graph = circuit_.graph;
    Node result = 0;
    for (unsigned i = 0; i < field.bytes; ++i) {
      const Byte byte = object[field.offset + i];
      const Node piece = graph.slice(byte.of, 8 * byte.index, 8);
      result = i == 0 ? piece : graph.concat(piece, result);
    }
    return result;
  }

  // The bits that the circuit has; that the others follow from them is a promise.
  Node taken(const Object& object, const Field& field, const Flop* flop) {
    Graph& graph = circuit_.graph;
    const Node whole = read(object, field);
    Node kept = graph.slice(whole, 0, field.width);
    if (flop != nullptr && !field.kept.isAllOnes()) {
      kept = graph.either(graph.both(kept, graph.constant(field.kept)),
                          graph.constant(flop->reset & ~field.kept));
    }
    const Node again =
        field.is_signed ? graph.sign_extend(kept, 8 * field.bytes) : graph.zero_extend(kept, 8 * field.bytes);
    const Node broken = graph.invert(graph.binary(Op::kEqual, again, whole));
    if (!graph.is_constant(broken) || !graph.value(broken).isZero())
      circuit_.promises.push_back(
          {broken, fmt::format("{} has more bits than the circuit", field.name), graph.place(whole)});
    return kept;
  }

  // A byte of a struct whose value is not given: what a function's argument points to.
  struct StructByte {
    std::string function;
    unsigned argument;
    llvm::Type* type;
    std::uint64_t at;
  };

  // A byte that a function is there to write.
  static bool is_result(const StructByte& byte) {
    return ((byte.function == "hls_outputs" || byte.function == "hls_in_reset") && byte.argument == 2) ||
           (byte.function == "hls_invariants" && byte.argument == 1);
  }

  llvm::Module& module_;
  Circuit circuit_;
  OpenValues opens_;
  std::unordered_map<Node, StructByte> bytes_;
};

}  // namespace

Circuit translate(llvm::Module& module) { return Translation(module).run(); }

}  // namespace meltstage::hls
