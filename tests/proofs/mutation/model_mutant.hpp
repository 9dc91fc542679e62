// SPDX-License-Identifier: Apache-2.0
// Operators of C++ that mutate_model.py has put a mutant into: `a < Lt{7} < b` is `a < b`, and `a <= b` while
// mutant 7 is chosen. The mark has the precedence of the operator that it stands at, so that no operand has
// to be found. What is worked out at compile time is never a mutant. `&&` and `||` evaluate both sides here.
#pragma once

#include <type_traits>

namespace meltstage::mutant {

extern unsigned chosen;  // 0: the model as it is

constexpr bool is(unsigned number) { return !std::is_constant_evaluated() && chosen == number; }

template <class Mark, class A>
struct Half {
  A a;
  unsigned number;
};

#define MELTSTAGE_MUTANT(Mark, op, broken)                  \
  struct Mark {                                             \
    unsigned number;                                        \
  };                                                        \
  template <class A>                                        \
  constexpr Half<Mark, A> operator op(A a, Mark mark) {     \
    return {a, mark.number};                                \
  }                                                         \
  template <class A, class B>                               \
  constexpr auto operator op(Half<Mark, A> half, B b) {     \
    return is(half.number) ? half.a broken b : half.a op b; \
  }
MELTSTAGE_MUTANT(Lt, <, <=)
MELTSTAGE_MUTANT(Le, <=, <)
MELTSTAGE_MUTANT(Gt, >, >=)
MELTSTAGE_MUTANT(Ge, >=, >)
MELTSTAGE_MUTANT(Eq, ==, !=)
MELTSTAGE_MUTANT(Ne, !=, ==)
MELTSTAGE_MUTANT(Add, +, -)
MELTSTAGE_MUTANT(Sub, -, +)
MELTSTAGE_MUTANT(And, &&, ||)
MELTSTAGE_MUTANT(Or, ||, &&)
MELTSTAGE_MUTANT(BitAnd, &, |)
MELTSTAGE_MUTANT(BitOr, |, &)
MELTSTAGE_MUTANT(Xor, ^, |)
MELTSTAGE_MUTANT(Left, <<, >>)
MELTSTAGE_MUTANT(Right, >>, <<)
#undef MELTSTAGE_MUTANT

template <class T>
constexpr T next(unsigned number, T value) {
  return is(number) ? value + 1 : value;
}
template <class T>
constexpr bool condition(unsigned number, const T& value) {
  return is(number) != static_cast<bool>(value);
}

}  // namespace meltstage::mutant
