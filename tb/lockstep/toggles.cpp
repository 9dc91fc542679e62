// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/toggles.hpp"

#include <fmt/format.h>

#include <bit>
#include <string_view>
#include <type_traits>

namespace meltstage::tb {
namespace {

struct Word {
  std::string_view block;
  std::string name;
  unsigned width;
  std::uint64_t bits;  // that are flops
};

#define TC_TEXT2(x) #x
#define TC_TEXT1(x) TC_TEXT2(x)

const std::vector<Word>& words() {
  static const std::vector<Word> list = [] {
    std::vector<Word> made;
#define TC_FLOP(type, name, width, reset) \
  made.push_back(                         \
      {TC_TEXT1(TC_MEMBER), TC_TEXT1(TC_MEMBER) "." #name, width, ~std::uint64_t{0} >> (64 - (width))});
#define TC_ARRAY(type, name, count, width)                                                                  \
  for (unsigned word = 0; word < (count); ++word)                                                           \
    made.push_back({TC_TEXT1(TC_MEMBER), fmt::format("{}.{}[{}]", TC_TEXT1(TC_MEMBER), #name, word), width, \
                    chip::array_flops<std::remove_cvref_t<decltype(chip::Chip::TC_MEMBER)>>(word, width)});
#include "cmodel/for_each_flop.inc"
    return made;
  }();
  return list;
}

template <class Take>
void for_values(const chip::Chip& chip, const Take& take) {
  std::size_t i = 0;
#define TC_FLOP(type, name, width, reset) take(i++, static_cast<std::uint64_t>(chip.TC_MEMBER.name));
#define TC_ARRAY(type, name, count, width)        \
  for (unsigned word = 0; word < (count); ++word) \
    take(i++, static_cast<std::uint64_t>(chip.TC_MEMBER.name[word]));
#include "cmodel/for_each_flop.inc"
}

}  // namespace

void FlopToggles::observe(const chip::Chip& now) {
  for_values(now, [&](std::size_t i, std::uint64_t value) {
    const std::uint64_t changed = value ^ last_[i];
    if (changed == 0) return;
    rose[i] |= changed & value;
    fell[i] |= changed & last_[i];
    last_[i] = value;
  });
}

void FlopToggles::resume(const chip::Chip& state) {
  for_values(state, [&](std::size_t i, std::uint64_t value) { last_[i] = value; });
}

void FlopToggles::add(const FlopToggles& other) {
  for (std::size_t i = 0; i < kWords; ++i) {
    rose[i] |= other.rose[i];
    fell[i] |= other.fell[i];
  }
}

std::vector<FlopToggles::Block> FlopToggles::blocks() const {
  std::vector<Block> list;
  for (std::size_t i = 0; i < kWords; ++i) {
    const Word& word = words()[i];
    if (list.empty() || list.back().name != word.block) list.push_back({std::string(word.block), 0, 0});
    list.back().bits += static_cast<unsigned>(std::popcount(word.bits));
    list.back().switched += static_cast<unsigned>(std::popcount(word.bits & rose[i] & fell[i]));
  }
  return list;
}

std::vector<std::string> FlopToggles::still() const {
  std::vector<std::string> list;
  for (std::size_t i = 0; i < kWords; ++i) {
    const Word& word = words()[i];
    for (unsigned bit = 0; bit < word.width; ++bit) {
      const std::uint64_t mask = std::uint64_t{1} << bit;
      const bool up = (rose[i] & mask) != 0, down = (fell[i] & mask) != 0;
      if ((word.bits & mask) == 0 || (up && down)) continue;
      list.push_back(fmt::format("{}{}: never {}", word.name, word.width == 1 ? "" : fmt::format("[{}]", bit),
                                 up     ? "fell"
                                 : down ? "rose"
                                        : "switched"));
    }
  }
  return list;
}

}  // namespace meltstage::tb
