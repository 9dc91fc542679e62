// SPDX-License-Identifier: Apache-2.0
#include "hls/graph/aig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <fstream>
#include <sstream>
#include <utility>

#include "base/error.hpp"
#include "base/file.hpp"

namespace meltstage::hls {

Literal Aig::input() {
  ands_.push_back({kNoLiteral, kNoLiteral});
  inputs_.push_back(static_cast<Literal>(2 * (ands_.size() - 1)));
  return inputs_.back();
}

Literal Aig::both(Literal a, Literal b) {
  if (a > b) std::swap(a, b);
  if (a == kFalse || a == (b ^ 1)) return kFalse;
  if (a == kTrue || a == b) return b;
  const auto [known, is_new] =
      known_.try_emplace(std::uint64_t{a} << 32 | b, static_cast<Literal>(2 * ands_.size()));
  if (is_new) ands_.push_back({a, b});
  return known->second;
}

std::vector<std::uint32_t> Aig::cone(std::span<const Literal> roots) const {
  std::vector<bool> needed(nodes(), false);
  for (const Literal root : roots) needed[root / 2] = true;
  for (std::size_t node = nodes(); node-- > 1;) {
    if (!needed[node] || is_input(node)) continue;
    needed[ands_[node].a / 2] = true;
    needed[ands_[node].b / 2] = true;
  }
  std::vector<std::uint32_t> result;
  for (std::uint32_t node = 1; node < nodes(); ++node)
    if (needed[node]) result.push_back(node);
  return result;
}

// ---- Bits of expressions ---------------------------------------------------------------------------------

const Word& Blaster::bits(Node node) {
  // without recursion: paths through the circuit are long
  std::vector<Node> open = {node};
  while (!open.empty()) {
    const Node at = open.back();
    if (known_.contains(at)) {
      open.pop_back();
      continue;
    }
    const Expression& e = graph_[at];
    bool ready = true;
    for (unsigned i = 0; i < argument_count(e.op); ++i) {
      if (known_.contains(e.arguments[i])) continue;
      open.push_back(e.arguments[i]);
      ready = false;
    }
    if (!ready) continue;
    open.pop_back();
    known_.emplace(at, make(e, at));
  }
  return known_.at(node);
}

Word Blaster::make(const Expression& e, Node node) {
  const auto a = [&]() -> const Word& { return known_.at(e.arguments[0]); };
  const auto b = [&]() -> const Word& { return known_.at(e.arguments[1]); };
  const auto bitwise = [&](auto gate) {
    Word result;
    for (unsigned i = 0; i < e.width; ++i) result.push_back(gate(a()[i], b()[i]));
    return result;
  };
  const auto inverted = [](Word word) {
    for (Literal& bit : word) bit ^= 1;
    return word;
  };
  switch (e.op) {
    case Op::kInput: {
      Word result;
      for (unsigned i = 0; i < e.width; ++i)
        result.push_back(
            inputs_.at(e.width == 1 ? graph_.name(node) : fmt::format("{}[{}]", graph_.name(node), i)));
      return result;
    }
    case Op::kAny:
      return any(e.width);
    case Op::kConstant: {
      Word result;
      for (unsigned i = 0; i < e.width; ++i) result.push_back(graph_.value(node)[i] ? kTrue : kFalse);
      return result;
    }
    case Op::kNot:
      return inverted(a());
    case Op::kAnd:
      return bitwise([&](Literal x, Literal y) { return aig_.both(x, y); });
    case Op::kOr:
      return bitwise([&](Literal x, Literal y) { return aig_.either(x, y); });
    case Op::kXor:
      return bitwise([&](Literal x, Literal y) { return aig_.differ(x, y); });
    case Op::kAdd:
      return sum(a(), b(), kFalse);
    case Op::kSub:
      return sum(a(), inverted(b()), kTrue);
    case Op::kMul:
      return products_.empty() || e.width > kProductBits || graph_.is_constant(e.arguments[0]) ||
                     graph_.is_constant(e.arguments[1])
                 ? product(a(), b())
                 : named_product(a(), b());
    case Op::kUnsignedDivide:
      return quotient(a(), b()).first;
    case Op::kUnsignedRemainder:
      return quotient(a(), b()).second;
    case Op::kSignedDivide:
    case Op::kSignedRemainder: {
      const Word zero(e.width, kFalse);
      const auto magnitude = [&](const Word& x) {
        return chosen(x.back(), sum(zero, inverted(x), kTrue), x);
      };
      const auto [whole, rest] = quotient(magnitude(a()), magnitude(b()));
      const Word& result = e.op == Op::kSignedDivide ? whole : rest;
      const Literal negative = e.op == Op::kSignedDivide ? aig_.differ(a().back(), b().back()) : a().back();
      return chosen(negative, sum(zero, inverted(result), kTrue), result);
    }
    case Op::kShiftLeft:
    case Op::kShiftRight:
    case Op::kShiftRightSigned:
      return shifted(a(), b(), e.op);
    case Op::kEqual:
      return {same(a(), b())};
    case Op::kLess:
      return {less(a(), b())};
    case Op::kLessSigned: {
      Word x = a();
      Word y = b();
      x.back() ^= 1;
      y.back() ^= 1;
      return {less(x, y)};
    }
    case Op::kSelect:
      return chosen(a()[0], b(), known_.at(e.arguments[2]));
    case Op::kConcat: {
      Word result = b();
      result.insert(result.end(), a().begin(), a().end());
      return result;
    }
    case Op::kSlice:
      return {a().begin() + e.low, a().begin() + e.low + e.width};
    case Op::kSignExtend: {
      Word result = a();
      result.resize(e.width, a().back());
      return result;
    }
  }
  return {};
}

Word Blaster::sum(const Word& a, const Word& b, Literal carry) {
  Word result;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Literal half = aig_.differ(a[i], b[i]);
    result.push_back(aig_.differ(half, carry));
    carry = aig_.either(aig_.both(a[i], b[i]), aig_.both(half, carry));
  }
  return result;
}

Word Blaster::product(const Word& a, const Word& b) {
  Word result(a.size(), kFalse);
  for (std::size_t i = 0; i < b.size(); ++i) {
    Word row(a.size(), kFalse);
    for (std::size_t j = i; j < a.size(); ++j) row[j] = aig_.both(a[j - i], b[i]);
    if (std::any_of(row.begin(), row.end(), [](Literal bit) { return bit != kFalse; }))
      result = sum(result, row, kFalse);
  }
  return result;
}

Word Blaster::named_product(const Word& a, const Word& b) {
  const auto wide = [](Word word) {
    word.resize(kProductBits, word.back());
    return word;
  };
  Word result = any(static_cast<unsigned>(a.size()));
  for (const Product& product : products_) {
    const auto is_of = [&](const Word& x, const Word& y) {
      return aig_.both(same(wide(x), product.a), same(wide(y), product.b));
    };
    const Word low(product.result.begin(), product.result.begin() + static_cast<std::ptrdiff_t>(a.size()));
    const Literal known = aig_.either(is_of(a, b), is_of(b, a));
    if (known == kTrue) return low;  // whatever the other products are
    result = chosen(known, low, result);
  }
  return result;
}

Word Blaster::any(unsigned width) {
  Word result;
  for (unsigned i = 0; i < width; ++i) result.push_back(aig_.input());
  return result;
}

Literal Blaster::same(const Word& a, const Word& b) {
  Literal result = kTrue;
  for (std::size_t i = 0; i < a.size(); ++i) result = aig_.both(result, aig_.differ(a[i], b[i]) ^ 1);
  return result;
}

// Quotient and remainder; of a division by 0 all ones, and the dividend.
std::pair<Word, Word> Blaster::quotient(const Word& a, const Word& b) {
  const std::size_t bits = a.size();
  Word rest(bits, kFalse);
  Word whole(bits, kFalse);
  for (std::size_t i = bits; i-- > 0;) {
    const Literal top = rest.back();
    rest.insert(rest.begin(), a[i]);
    rest.pop_back();
    whole[i] = aig_.either(top, less(rest, b) ^ 1);
    Word divisor = b;
    for (Literal& bit : divisor) bit ^= 1;
    rest = chosen(whole[i], sum(rest, divisor, kTrue), rest);
  }
  return {whole, rest};
}

Word Blaster::shifted(const Word& a, const Word& by, Op op) {
  const Literal fill = op == Op::kShiftRightSigned ? a.back() : kFalse;
  Word result = a;
  Literal beyond = kFalse;
  for (std::size_t k = 0; k < by.size(); ++k) {
    if (k >= 31 || (std::size_t{1} << k) >= a.size()) {
      beyond = aig_.either(beyond, by[k]);
      continue;
    }
    const std::size_t step = std::size_t{1} << k;
    Word moved(a.size(), fill);
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (op == Op::kShiftLeft && i >= step) moved[i] = result[i - step];
      if (op != Op::kShiftLeft && i + step < a.size()) moved[i] = result[i + step];
    }
    result = chosen(by[k], moved, result);
  }
  return chosen(beyond, Word(a.size(), fill), result);
}

Literal Blaster::less(const Word& a, const Word& b) {
  Literal result = kFalse;
  for (std::size_t i = 0; i < a.size(); ++i) result = aig_.select(aig_.differ(a[i], b[i]), b[i], result);
  return result;
}

Word Blaster::chosen(Literal condition, const Word& then, const Word& otherwise) {
  Word result;
  for (std::size_t i = 0; i < then.size(); ++i)
    result.push_back(aig_.select(condition, then[i], otherwise[i]));
  return result;
}

// ---- Files -----------------------------------------------------------------------------------------------

namespace {

class Reader {
 public:
  Reader(std::string text, std::string path) : text_(std::move(text)), path_(std::move(path)) {}

  std::string line() {
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string::npos) fail();
    std::string result = text_.substr(at_, end - at_);
    at_ = end + 1;
    return result;
  }
  std::uint32_t delta() {
    std::uint32_t value = 0;
    for (int shift = 0;; shift += 7) {
      if (at_ == text_.size() || shift > 28) fail();
      const auto byte = static_cast<unsigned char>(text_[at_++]);
      value |= static_cast<std::uint32_t>(byte & 0x7F) << shift;
      if ((byte & 0x80) == 0) return value;
    }
  }
  bool at_end() const { return at_ == text_.size(); }
  [[noreturn]] void fail() const {
    throw UserError(fmt::format("{}: found no binary AIGER file, or one that is cut off", path_));
  }

 private:
  std::string text_;
  std::string path_;
  std::size_t at_ = 0;
};

}  // namespace

AigerFile read_aiger(const std::filesystem::path& path) {
  Reader reader(read_file(path, "an AIGER file"), path.string());
  std::istringstream head(reader.line());
  std::string kind;
  std::size_t highest = 0, inputs = 0, latches = 0, outputs = 0, ands = 0;
  if (!(head >> kind >> highest >> inputs >> latches >> outputs >> ands) || kind != "aig" || latches != 0 ||
      highest != inputs + ands || highest > (1u << 28))
    reader.fail();
  AigerFile file;
  file.inputs.resize(inputs);
  file.outputs.resize(outputs);
  for (AigerFile::Output& output : file.outputs)
    output.value = static_cast<std::uint32_t>(std::stoul(reader.line()));
  for (std::size_t i = 0; i < ands; ++i) {
    const auto self = static_cast<std::uint32_t>(2 * (inputs + 1 + i));
    const std::uint32_t a = self - reader.delta();
    const std::uint32_t b = a - reader.delta();
    if (a >= self || b > a) reader.fail();
    file.ands.push_back({a, b});
  }
  while (!reader.at_end()) {
    const std::string line = reader.line();
    if (line.empty() || line[0] == 'c') break;
    const std::size_t space = line.find(' ');
    if (space == std::string::npos) reader.fail();
    const std::size_t index = std::stoul(line.substr(1, space - 1));
    const std::string name = line.substr(space + 1);
    if (line[0] == 'i' && index < inputs) file.inputs[index] = name;
    if (line[0] == 'o' && index < outputs) file.outputs[index].name = name;
  }
  return file;
}

void write_aiger(const std::filesystem::path& path, const Aig& aig, std::span<const Literal> outputs) {
  std::ofstream out(path, std::ios::binary);
  const std::vector<std::uint32_t> cone = aig.cone(outputs);
  std::vector<Literal> number(aig.nodes(), 0);  // in the file
  Literal next = 0;
  for (const Literal input : aig.inputs()) number[input / 2] = next += 2;
  std::size_t ands = 0;
  for (const std::uint32_t node : cone) {
    if (aig.is_input(node)) continue;
    number[node] = next += 2;
    ++ands;
  }
  const auto written = [&](Literal literal) { return number[literal / 2] | (literal & 1); };
  out << fmt::format("aig {} {} 0 {} {}\n", next / 2, aig.inputs().size(), outputs.size(), ands);
  for (const Literal output : outputs) out << written(output) << '\n';
  const auto delta = [&](std::uint32_t value) {
    for (; value >= 0x80; value >>= 7) out.put(static_cast<char>(value | 0x80));
    out.put(static_cast<char>(value));
  };
  for (const std::uint32_t node : cone) {
    if (aig.is_input(node)) continue;
    const auto [low, high] = std::minmax({written(aig[node].a), written(aig[node].b)});
    delta(number[node] - high);
    delta(high - low);
  }
  out.close();
  if (!out) throw UserError(fmt::format("{}: can't be written; is there room?", path.string()));
}

}  // namespace meltstage::hls
