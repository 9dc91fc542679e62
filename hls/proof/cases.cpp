// SPDX-License-Identifier: Apache-2.0
#include "hls/proof/cases.hpp"

#include <algorithm>
#include <map>
#include <random>
#include <utility>

namespace meltstage::hls {
namespace {

constexpr std::size_t kMostBits = 8;  // of a number whose values are cases
constexpr int kDeepest = 6;           // cases within cases

using Values = std::vector<std::pair<Literal, bool>>;

Values values_of(const Number& number, std::size_t value) {
  Values result;
  for (std::size_t i = 0; i < number.bits.size(); ++i)
    result.emplace_back(number.bits[i], (value >> i & 1) != 0);
  return result;
}

// Gives an example the values of its case.
void put(const Aig& aig, const Values& known, std::vector<bool>& example) {
  if (example.empty()) return;
  for (const auto& [input, value] : known) {
    const auto found = std::find(aig.inputs().begin(), aig.inputs().end(), input);
    example[static_cast<std::size_t>(found - aig.inputs().begin())] = value;
  }
}

std::size_t size_of(const Work& work) { return work.aig.cone(work.wrong).size(); }

// Gates that are left, on average over some values.
std::size_t size_in_cases(const Work& work, const Number& number) {
  constexpr std::size_t kTries = 4;
  const std::size_t values = std::size_t{1} << number.bits.size();
  const std::size_t tries = std::min(values, kTries);
  std::mt19937_64 random(1);
  std::size_t sum = 0;
  for (std::size_t i = 0; i < tries; ++i)
    sum += size_of(in_case(work, values_of(number, values <= kTries ? i : random() % values)));
  return sum / tries;
}

// The number whose cases are the smallest; none when no one makes much of a difference.
const Number* best_of(const Work& work, const std::vector<Number>& numbers) {
  const std::vector<std::uint32_t> cone = work.aig.cone(work.wrong);
  const Number* best = nullptr;
  std::size_t smallest = cone.size() * 9 / 10;
  for (const Number& number : numbers) {
    const bool used = std::any_of(number.bits.begin(), number.bits.end(), [&](Literal bit) {
      return std::binary_search(cone.begin(), cone.end(), bit / 2);
    });
    if (!used) continue;
    const std::size_t size = size_in_cases(work, number);
    if (size >= smallest) continue;
    smallest = size;
    best = &number;
  }
  return best;
}

std::vector<Answer> in_cases(const Work& work, const std::vector<Number>& numbers, const EngineLimits& limits,
                             int deep) {
  std::vector<Answer> answers(work.wrong.size());
  const Number* number = deep == kDeepest ? nullptr : best_of(work, numbers);
  if (number == nullptr) return answers;
  Work left = work;  // of the obligations that every case so far has shown
  for (std::size_t value = 0; value < std::size_t{1} << number->bits.size(); ++value) {
    const Values known = values_of(*number, value);
    const Work asked = in_case(left, known);
    std::vector<Answer> here(answers.size());
    ask_engines(asked, limits, {}, here);
    Work open = asked;
    bool any = false;
    for (std::size_t i = 0; i < here.size(); ++i) {
      if (here[i].verdict != Verdict::kOpen) open.wrong[i] = kFalse;
      any |= here[i].verdict == Verdict::kOpen;
    }
    if (any) {
      const std::vector<Answer> deeper = in_cases(open, numbers, limits, deep + 1);
      for (std::size_t i = 0; i < here.size(); ++i)
        if (here[i].verdict == Verdict::kOpen) here[i] = deeper[i];
    }
    for (std::size_t i = 0; i < here.size(); ++i) {
      if (here[i].verdict == Verdict::kHolds) continue;
      left.wrong[i] = kFalse;
      put(work.aig, known, here[i].example);
      answers[i] = std::move(here[i]);
    }
  }
  for (std::size_t i = 0; i < answers.size(); ++i)
    if (left.wrong[i] == work.wrong[i] && answers[i].verdict == Verdict::kOpen)
      answers[i] = {Verdict::kHolds, Method::kCases, {}};
  return answers;
}

}  // namespace

std::vector<Number> small_numbers(const Problem& problem) {
  std::map<std::string, std::map<unsigned, Literal>> found;
  for (const Bits* bits : {&problem.state, &problem.pins}) {
    for (const auto& [name, literal] : *bits) {
      if (literal < 2) continue;  // a constant
      const std::size_t bracket = name.rfind('[');
      const bool whole = bracket == std::string::npos;
      found[name.substr(0, bracket)]
           [whole ? 0 : static_cast<unsigned>(std::stoul(name.substr(bracket + 1)))] = literal;
    }
  }
  std::vector<Number> result;
  for (const auto& [name, bits] : found) {
    if (bits.size() > kMostBits) continue;
    result.push_back({name, {}});
    for (const auto& [bit, literal] : bits) result.back().bits.push_back(literal);
  }
  return result;
}

std::vector<Answer> prove_by_cases(const Work& work, const std::vector<Number>& numbers,
                                   const EngineLimits& limits) {
  return in_cases(work, numbers, limits, 0);
}

}  // namespace meltstage::hls
