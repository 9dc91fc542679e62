// SPDX-License-Identifier: Apache-2.0
#include "hls/graph/graph.hpp"

#include <llvm/ADT/SmallString.h>

#include <algorithm>
#include <utility>

namespace meltstage::hls {
namespace {

bool compares(Op op) { return op == Op::kEqual || op == Op::kLess || op == Op::kLessSigned; }

bool commutes(Op op) {
  switch (op) {
    case Op::kAnd:
    case Op::kOr:
    case Op::kXor:
    case Op::kAdd:
    case Op::kMul:
    case Op::kEqual:
      return true;
    default:
      return false;
  }
}

// The same where the bits above repeat the sign.
bool narrows_signed(Op op) {
  switch (op) {
    case Op::kAnd:
    case Op::kOr:
    case Op::kXor:
    case Op::kAdd:
    case Op::kSub:
    case Op::kMul:
    case Op::kEqual:
    case Op::kLessSigned:
      return true;
    default:
      return false;
  }
}

// Operators of which the bits above the arguments' used ones are 0, so that a narrower one does.
bool narrows(Op op) {
  switch (op) {
    case Op::kAnd:
    case Op::kOr:
    case Op::kXor:
    case Op::kAdd:
    case Op::kMul:
    case Op::kUnsignedDivide:
    case Op::kUnsignedRemainder:
    case Op::kShiftRight:
    case Op::kEqual:
    case Op::kLess:
      return true;
    default:
      return false;
  }
}

}  // namespace

unsigned argument_count(Op op) {
  switch (op) {
    case Op::kInput:
    case Op::kAny:
    case Op::kConstant:
      return 0;
    case Op::kNot:
    case Op::kSlice:
    case Op::kSignExtend:
      return 1;
    case Op::kSelect:
      return 3;
    default:
      return 2;
  }
}

std::size_t Graph::Hash::operator()(const Expression& e) const {
  std::size_t hash = static_cast<std::size_t>(e.op) * 1000003u + e.width * 8191u + e.low;
  for (const Node argument : e.arguments) hash = hash * 0x9E3779B97F4A7C15u + argument;
  return hash;
}

bool Graph::Equal::operator()(const Expression& a, const Expression& b) const {
  return a.op == b.op && a.width == b.width && a.low == b.low && a.arguments == b.arguments;
}

Graph::Graph() { places_.emplace_back(); }

void Graph::at(Place place) {
  if (place.file != places_.back().file || place.line != places_.back().line)
    places_.push_back(std::move(place));
}

Node Graph::make(Op op, unsigned width, std::array<Node, 3> arguments, unsigned low) {
  Expression e{.op = op, .width = width, .arguments = arguments, .low = low};
  e.used = used_bits(e);
  e.significant = significant_bits(e);
  const auto [known, is_new] = known_.try_emplace(e, static_cast<Node>(expressions_.size()));
  if (is_new) {
    expressions_.push_back(e);
    place_of_.push_back(static_cast<unsigned>(places_.size() - 1));
  }
  return known->second;
}

unsigned Graph::used_bits(const Expression& e) const {
  const auto used = [&](unsigned i) { return expressions_[e.arguments[i]].used; };
  switch (e.op) {
    case Op::kConstant:
      return values_[e.low].getActiveBits();
    case Op::kAnd:
      return std::min(used(0), used(1));
    case Op::kOr:
    case Op::kXor:
      return std::max(used(0), used(1));
    case Op::kAdd:
      return std::min(e.width, std::max(used(0), used(1)) + 1);
    case Op::kMul:
      return std::min(e.width, used(0) + used(1));
    case Op::kUnsignedDivide:
      return is_constant(e.arguments[1]) && !is_zero(e.arguments[1]) ? used(0) : e.width;  // by 0: all ones
    case Op::kShiftRight:
      return used(0);
    case Op::kUnsignedRemainder:
      return is_constant(e.arguments[1]) && !is_zero(e.arguments[1]) ? std::min(used(0), used(1)) : used(0);
    case Op::kSelect:
      return std::max(used(1), used(2));
    case Op::kConcat:
      return used(0) == 0 ? used(1) : expressions_[e.arguments[1]].width + used(0);
    case Op::kSlice:
      return std::min(e.width, used(0) > e.low ? used(0) - e.low : 0);
    default:
      return e.width;
  }
}

unsigned Graph::significant_bits(const Expression& e) const {
  const unsigned without_sign = std::min(e.width, e.used + 1);
  const auto of = [&](unsigned i) { return expressions_[e.arguments[i]].significant; };
  const auto largest = [&](unsigned i, unsigned j) { return std::max(of(i), of(j)); };
  switch (e.op) {
    case Op::kConstant:
      return values_[e.low].getMinSignedBits();
    case Op::kNot:
      return of(0);
    case Op::kAnd:
    case Op::kOr:
    case Op::kXor:
      return std::min(without_sign, largest(0, 1));
    case Op::kAdd:
    case Op::kSub:
      return std::min({without_sign, e.width, largest(0, 1) + 1});
    case Op::kMul:
      return std::min({without_sign, e.width, of(0) + of(1)});
    case Op::kSelect:
      return std::min(without_sign, largest(1, 2));
    case Op::kSlice:
      return e.low + e.width > of(0) && of(0) > e.low ? std::min(without_sign, of(0) - e.low) : without_sign;
    case Op::kSignExtend:
      return of(0);
    default:
      return without_sign;
  }
}

Node Graph::input(std::string name, unsigned width) {
  names_.push_back(std::move(name));
  return make(Op::kInput, width, {}, static_cast<unsigned>(names_.size() - 1));
}

Node Graph::any(unsigned width) { return make(Op::kAny, width, {}, static_cast<unsigned>(size())); }

Node Graph::constant(const APInt& value) {
  llvm::SmallString<40> text;
  value.toStringUnsigned(text, 16);
  const auto [known, is_new] = constants_.try_emplace(
      std::to_string(value.getBitWidth()) + '.' + text.str().str(), static_cast<unsigned>(values_.size()));
  if (is_new) values_.push_back(value);
  return make(Op::kConstant, value.getBitWidth(), {}, known->second);
}

Node Graph::fold(Op op, const APInt& a, const APInt& b) {
  switch (op) {
    case Op::kAnd:
      return constant(a & b);
    case Op::kOr:
      return constant(a | b);
    case Op::kXor:
      return constant(a ^ b);
    case Op::kAdd:
      return constant(a + b);
    case Op::kSub:
      return constant(a - b);
    case Op::kMul:
      return constant(a * b);
    case Op::kUnsignedDivide:
      return constant(b.isZero() ? APInt::getAllOnes(a.getBitWidth()) : a.udiv(b));
    case Op::kUnsignedRemainder:
      return constant(b.isZero() ? a : a.urem(b));
    case Op::kSignedDivide:
      return constant(b.isZero() ? APInt::getAllOnes(a.getBitWidth()) : a.sdiv(b));
    case Op::kSignedRemainder:
      return constant(b.isZero() ? a : a.srem(b));
    case Op::kShiftLeft:
      return constant(a.shl(b));
    case Op::kShiftRight:
      return constant(a.lshr(b));
    case Op::kShiftRightSigned:
      return constant(a.ashr(b));
    case Op::kEqual:
      return truth(a == b);
    case Op::kLess:
      return truth(a.ult(b));
    default:
      return truth(a.slt(b));
  }
}

// x if a is 0 - x. A sign above it says the same of a longer x, but of the lowest.
std::optional<Node> Graph::negated(Node a) {
  const bool extended = expressions_[a].op == Op::kSignExtend;
  const Expression e = expressions_[extended ? expressions_[a].arguments[0] : a];
  if (e.op != Op::kSub || !is_zero(e.arguments[0])) return std::nullopt;
  if (extended && expressions_[e.arguments[1]].significant == e.width) return std::nullopt;
  return sign_extend(e.arguments[1], width(a));
}

// What a and b make without a node of this operator; `done` says whether there is such a thing.
Node Graph::simplified(Op op, Node a, Node b, bool& done) {
  const unsigned bits = width(a);
  const auto gives = [&](Node node) {
    done = true;
    return node;
  };
  if (is_constant(a) && is_constant(b)) return gives(fold(op, value(a), value(b)));
  switch (op) {
    case Op::kAnd:
      if (is_zero(b)) return gives(b);
      if (is_ones(b) || a == b) return gives(a);
      if (is_constant(b) && value(b).isMask()) {
        const unsigned kept = value(b).getActiveBits();
        return gives(zero_extend(slice(a, 0, kept), bits));
      }
      if (expressions_[a].op == Op::kNot && expressions_[a].arguments[0] == b)
        return gives(constant(bits, 0));
      if (expressions_[b].op == Op::kNot && expressions_[b].arguments[0] == a)
        return gives(constant(bits, 0));
      break;
    case Op::kOr:
      if (is_zero(b) || a == b) return gives(a);
      if (is_ones(b)) return gives(b);
      if (expressions_[a].op == Op::kNot && expressions_[a].arguments[0] == b)
        return gives(constant(APInt::getAllOnes(bits)));
      if (expressions_[b].op == Op::kNot && expressions_[b].arguments[0] == a)
        return gives(constant(APInt::getAllOnes(bits)));
      break;
    case Op::kXor:
      if (is_zero(b)) return gives(a);
      if (is_ones(b)) return gives(invert(a));
      if (a == b) return gives(constant(bits, 0));
      break;
    case Op::kAdd:
      if (is_zero(b)) return gives(a);
      if (const auto less = negated(b)) return gives(binary(Op::kSub, a, *less));
      if (const auto less = negated(a)) return gives(binary(Op::kSub, b, *less));
      break;
    case Op::kSub:
      if (is_zero(b)) return gives(a);
      if (a == b) return gives(constant(bits, 0));
      break;
    case Op::kMul:
      if (is_zero(b)) return gives(b);
      if (is_constant(b) && value(b).isPowerOf2())
        return gives(binary(Op::kShiftLeft, a, constant(bits, value(b).logBase2())));
      if (is_constant(b) && (-value(b)).isPowerOf2())  // x - 8 y is an addition of -8 y to LLVM
        return gives(binary(Op::kSub, constant(bits, 0),
                            binary(Op::kShiftLeft, a, constant(bits, (-value(b)).logBase2()))));
      if (is_constant(b) && value(b).isMask() && value(b).getActiveBits() > 2)  // 7 a = 8 a - a
        return gives(
            binary(Op::kSub, binary(Op::kShiftLeft, a, constant(bits, value(b).getActiveBits())), a));
      if (is_constant(b) && value(b).countTrailingZeros() > 0) {  // the lowest bits are 0
        const unsigned zeros = value(b).countTrailingZeros();
        const unsigned kept = bits - zeros;
        return gives(concat(binary(Op::kMul, slice(a, 0, kept), constant(value(b).extractBits(kept, zeros))),
                            constant(zeros, 0)));
      }
      break;
    case Op::kUnsignedDivide:
      if (is_constant(b) && value(b).isPowerOf2())
        return gives(binary(Op::kShiftRight, a, constant(bits, value(b).logBase2())));
      break;
    case Op::kUnsignedRemainder:
      if (is_constant(b) && value(b).isPowerOf2()) return gives(binary(Op::kAnd, a, constant(value(b) - 1)));
      break;
    case Op::kShiftLeft:
    case Op::kShiftRight:
    case Op::kShiftRightSigned: {
      if (is_zero(b) || is_zero(a)) return gives(a);
      if (!is_constant(b)) break;
      const auto by = static_cast<unsigned>(value(b).getLimitedValue(bits));
      if (op == Op::kShiftLeft)
        return gives(by == bits ? constant(bits, 0) : concat(slice(a, 0, bits - by), constant(by, 0)));
      if (op == Op::kShiftRight)
        return gives(by == bits ? constant(bits, 0) : zero_extend(slice(a, by, bits - by), bits));
      return gives(sign_extend(by == bits ? slice(a, bits - 1, 1) : slice(a, by, bits - by), bits));
    }
    case Op::kEqual:
      if (a == b) return gives(truth(true));
      if (bits == 1 && is_constant(b)) return gives(is_zero(b) ? invert(a) : a);
      if (is_constant(b) && value(b).getActiveBits() > expressions_[a].used) return gives(truth(false));
      break;
    case Op::kLess:
      if (a == b || is_zero(b)) return gives(truth(false));
      if (is_constant(a) && value(a).getActiveBits() > expressions_[b].used) return gives(truth(false));
      if (is_constant(b) && value(b).getActiveBits() > expressions_[a].used) return gives(truth(true));
      if (bits == 1) return gives(both(invert(a), b));
      break;
    case Op::kLessSigned:
      if (a == b) return gives(truth(false));
      if (expressions_[a].used < bits && expressions_[b].used < bits) return gives(binary(Op::kLess, a, b));
      break;
    default:
      break;
  }
  return 0;
}

Node Graph::binary(Op op, Node a, Node b) {
  if (commutes(op) && (is_constant(a) || (!is_constant(b) && a > b))) std::swap(a, b);
  bool done = false;
  const Node simple = simplified(op, a, b, done);
  if (done) return simple;

  const unsigned bits = width(a);
  // what a division by 0 gives has all bits
  const bool may_divide_by_zero = op == Op::kUnsignedDivide && (!is_constant(b) || is_zero(b));
  if (narrows(op) && !may_divide_by_zero) {
    const Expression wide{.op = op, .width = bits, .arguments = {a, b, 0}};
    const unsigned least =
        std::max({1u, expressions_[a].used, expressions_[b].used, compares(op) ? 0 : used_bits(wide)});
    if (least < bits) {
      const Node narrow = binary(op, slice(a, 0, least), slice(b, 0, least));
      return compares(op) ? narrow : zero_extend(narrow, bits);
    }
  }
  if (narrows_signed(op)) {
    const unsigned x = expressions_[a].significant;
    const unsigned y = expressions_[b].significant;
    const unsigned least = compares(op) || op == Op::kAnd || op == Op::kOr || op == Op::kXor ? std::max(x, y)
                           : op == Op::kMul                                                  ? x + y
                                            : std::max(x, y) + 1;
    if (least < bits) {
      const Node narrow = binary(op, slice(a, 0, least), slice(b, 0, least));
      return compares(op) ? narrow : sign_extend(narrow, bits);
    }
  }
  return make(op, compares(op) ? 1 : bits, {a, b, 0});
}

Node Graph::invert(Node a) {
  if (is_constant(a)) return constant(~value(a));
  if (expressions_[a].op == Op::kNot) return expressions_[a].arguments[0];
  return make(Op::kNot, width(a), {a, 0, 0});
}

// One choice where two choices one behind the other lead to the same two values.
std::optional<Node> Graph::joined_select(Node condition, Node then, Node otherwise) {
  const Expression t = expressions_[then];
  if (t.op == Op::kSelect && t.arguments[2] == otherwise)
    return select(both(condition, t.arguments[0]), t.arguments[1], otherwise);
  if (t.op == Op::kSelect && t.arguments[1] == otherwise)
    return select(both(condition, invert(t.arguments[0])), t.arguments[2], otherwise);
  const Expression o = expressions_[otherwise];
  if (t.op == Op::kSelect && o.op == Op::kSelect && t.arguments[1] == o.arguments[1] &&
      t.arguments[2] == o.arguments[2])
    return select(select(condition, t.arguments[0], o.arguments[0]), t.arguments[1], t.arguments[2]);
  if (o.op == Op::kSelect && o.arguments[1] == then)
    return select(either(condition, o.arguments[0]), then, o.arguments[2]);
  if (o.op == Op::kSelect && o.arguments[2] == then)
    return select(either(condition, invert(o.arguments[0])), then, o.arguments[1]);
  return std::nullopt;
}

Node Graph::select(Node condition, Node then, Node otherwise) {
  if (is_constant(condition)) return is_zero(condition) ? otherwise : then;
  if (then == otherwise) return then;
  if (expressions_[condition].op == Op::kNot)
    return select(expressions_[condition].arguments[0], otherwise, then);
  if (expressions_[then].op == Op::kSelect && expressions_[then].arguments[0] == condition)
    return select(condition, expressions_[then].arguments[1], otherwise);
  if (expressions_[otherwise].op == Op::kSelect && expressions_[otherwise].arguments[0] == condition)
    return select(condition, then, expressions_[otherwise].arguments[2]);
  const unsigned bits = width(then);
  if (const auto joined = joined_select(condition, then, otherwise)) return *joined;
  if (bits == 1) {
    if (is_ones(then)) return either(condition, otherwise);
    if (is_zero(then)) return both(invert(condition), otherwise);
    if (is_ones(otherwise)) return either(invert(condition), then);
    if (is_zero(otherwise)) return both(condition, then);
  }
  const unsigned least = std::max({1u, expressions_[then].used, expressions_[otherwise].used});
  if (least < bits)
    return zero_extend(select(condition, slice(then, 0, least), slice(otherwise, 0, least)), bits);
  const unsigned least_signed = std::max(expressions_[then].significant, expressions_[otherwise].significant);
  if (least_signed < bits)
    return sign_extend(select(condition, slice(then, 0, least_signed), slice(otherwise, 0, least_signed)),
                       bits);
  return make(Op::kSelect, bits, {condition, then, otherwise});
}

Node Graph::concat(Node high, Node low) {
  if (is_constant(high) && is_constant(low)) return constant(value(high).concat(value(low)));
  // slices that lie side by side
  const Expression h = expressions_[high];
  const Expression l = expressions_[low];
  const Node of = h.op == Op::kSlice ? h.arguments[0] : high;
  if (l.op == Op::kSlice && l.arguments[0] == of && h.op == Op::kSlice && h.low == l.low + l.width)
    return slice(of, l.low, l.width + h.width);
  if (h.op == Op::kConcat && is_zero(h.arguments[0]))  // one run of zeros on top
    return zero_extend(concat(h.arguments[1], low), h.width + l.width);
  if (is_zero(high) && l.op == Op::kConcat && is_zero(l.arguments[0]))
    return zero_extend(l.arguments[1], h.width + l.width);
  return make(Op::kConcat, h.width + l.width, {high, low, 0});
}

Node Graph::slice(Node a, unsigned low, unsigned bits) {
  const Expression e = expressions_[a];
  if (low == 0 && bits == e.width) return a;
  if (is_constant(a)) return constant(value(a).extractBits(bits, low));
  if (low >= e.used) return constant(bits, 0);
  switch (e.op) {
    case Op::kSlice:
      return slice(e.arguments[0], low + e.low, bits);
    case Op::kConcat: {
      const unsigned below = width(e.arguments[1]);
      if (low >= below) return slice(e.arguments[0], low - below, bits);
      if (low + bits <= below) return slice(e.arguments[1], low, bits);
      return concat(slice(e.arguments[0], 0, low + bits - below), slice(e.arguments[1], low, below - low));
    }
    case Op::kSignExtend: {
      const unsigned from = width(e.arguments[0]);
      if (low + bits <= from) return slice(e.arguments[0], low, bits);
      if (low < from) return sign_extend(slice(e.arguments[0], low, from - low), bits);
      return sign_extend(slice(e.arguments[0], from - 1, 1), bits);
    }
    case Op::kAdd:
    case Op::kSub:
      if (low == 0 && bits == 1)  // the parity of a count needs no adder
        return binary(Op::kXor, slice(e.arguments[0], 0, 1), slice(e.arguments[1], 0, 1));
      break;
    default:
      break;
  }
  return make(Op::kSlice, bits, {a, 0, 0}, low);
}

Node Graph::zero_extend(Node a, unsigned bits) {
  return bits == width(a) ? a : concat(constant(bits - width(a), 0), a);
}

Node Graph::sign_extend(Node a, unsigned bits) {
  if (bits == width(a)) return a;
  if (is_constant(a)) return constant(value(a).sext(bits));
  if (expressions_[a].used < width(a)) return zero_extend(a, bits);
  if (expressions_[a].op == Op::kSignExtend) return sign_extend(expressions_[a].arguments[0], bits);
  return make(Op::kSignExtend, bits, {a, 0, 0});
}

std::vector<bool> Graph::behind(const std::vector<Node>& roots) const {
  std::vector<bool> result(size(), false);
  for (const Node root : roots) result[root] = true;
  for (Node node = static_cast<Node>(size()); node-- > 0;)
    for (unsigned i = 0; result[node] && i < argument_count(expressions_[node].op); ++i)
      result[expressions_[node].arguments[i]] = true;
  return result;
}

// An operator on other arguments.
Node Graph::again(const Expression& e, const std::array<Node, 3>& arguments) {
  switch (e.op) {
    case Op::kNot:
      return invert(arguments[0]);
    case Op::kSelect:
      return select(arguments[0], arguments[1], arguments[2]);
    case Op::kConcat:
      return concat(arguments[0], arguments[1]);
    case Op::kSlice:
      return slice(arguments[0], e.low, e.width);
    case Op::kSignExtend:
      return sign_extend(arguments[0], e.width);
    default:
      return binary(e.op, arguments[0], arguments[1]);
  }
}

std::vector<Node> Graph::replaced(const std::vector<Node>& roots, const std::unordered_map<Node, Node>& by) {
  const std::vector<bool> needed = behind(roots);
  std::vector<Node> image(needed.size());
  for (Node node = 0; node < needed.size(); ++node) {
    image[node] = node;
    if (!needed[node]) continue;
    if (const auto other = by.find(node); other != by.end()) image[node] = other->second;
    const Expression e = expressions_[node];
    std::array<Node, 3> arguments{};
    bool changed = false;
    for (unsigned i = 0; i < argument_count(e.op); ++i) {
      arguments[i] = image[e.arguments[i]];
      changed = changed || arguments[i] != e.arguments[i];
    }
    if (changed) image[node] = again(e, arguments);
  }
  std::vector<Node> result;
  for (const Node root : roots) result.push_back(image[root]);
  return result;
}

}  // namespace meltstage::hls
