// SPDX-License-Identifier: Apache-2.0
#include "tb/pins/flop_table.hpp"

#include <fmt/format.h>

#include <string_view>
#include <type_traits>

namespace meltstage::tb {

namespace {

// The value of `width` bits as the model holds it: signed ones with their sign.
template <class T, unsigned width>
T held(std::uint64_t value) {
  value &= ones(width);
  if constexpr (std::is_signed_v<T>) {
    if ((value >> (width - 1) & 1) != 0) value |= ~ones(width);
  }
  return static_cast<T>(value);
}

}  // namespace

// Each block's flops; an array's words stand together, so that an array is drawn as often as a flop.
const std::vector<FlopBlock>& flop_blocks() {
  static const std::vector<FlopBlock> list = [] {
    std::vector<FlopBlock> made;
    std::string_view last;
    std::size_t place = 0;
    const auto add = [&](std::string_view instance, FlopWords flops) {
      if (instance != last) made.emplace_back();
      last = instance;
      for (Flop& flop : flops) {
        flop.place = place++;
        flop.block = made.size() - 1;
      }
      std::erase_if(flops, [](const Flop& flop) { return flop.changeable == 0; });
      made.back().push_back(std::move(flops));
    };
#define TC_TEXT2(x) #x
#define TC_TEXT1(x) TC_TEXT2(x)
#define TC_FLOP(type, name, width, reset)                                    \
  add(TC_TEXT1(TC_INSTANCE),                                                 \
      {{TC_TEXT1(TC_MEMBER) "." #name, width, ones(width), 0, false,         \
        [](const chip::Chip& c, unsigned) {                                  \
          return static_cast<std::uint64_t>(c.TC_MEMBER.name) & ones(width); \
        },                                                                   \
        [](chip::Chip& c, unsigned, std::uint64_t v) { c.TC_MEMBER.name = held<type, width>(v); }}});
#define TC_ARRAY(type, name, count, width)                                                                   \
  {                                                                                                          \
    FlopWords words;                                                                                         \
    for (unsigned word = 0; word < (count); ++word) {                                                        \
      words.push_back(                                                                                       \
          {TC_TEXT1(TC_MEMBER) "." #name, width,                                                             \
           chip::array_flops<std::remove_cvref_t<decltype(chip::Chip::TC_MEMBER)>>(word, width), word, true, \
           [](const chip::Chip& c, unsigned w) { return std::uint64_t{c.TC_MEMBER.name[w]}; },               \
           [](chip::Chip& c, unsigned w, std::uint64_t v) { c.TC_MEMBER.name[w] = held<type, width>(v); }}); \
    }                                                                                                        \
    add(TC_TEXT1(TC_INSTANCE), std::move(words));                                                            \
  }
#include "cmodel/for_each_flop.inc"
    return made;
  }();
  return list;
}

const std::vector<const Flop*>& flops_in_order() {
  static const std::vector<const Flop*> list = [] {
    std::vector<const Flop*> made(kFlopPlaces);
    for (const FlopBlock& block : flop_blocks())
      for (const FlopWords& words : block)
        for (const Flop& flop : words) made[flop.place] = &flop;
    return made;
  }();
  return list;
}

void for_each_changed(const chip::Chip& was, const chip::Chip& is,
                      const std::function<void(const Flop&)>& take) {
  const std::vector<const Flop*>& flops = flops_in_order();
  std::size_t place = 0;
#define TC_FLOP(type, name, width, reset)                           \
  if (was.TC_MEMBER.name != is.TC_MEMBER.name) take(*flops[place]); \
  ++place;
#define TC_ARRAY(type, name, count, width)                                        \
  for (unsigned word = 0; word < (count); ++word) {                               \
    if (was.TC_MEMBER.name[word] != is.TC_MEMBER.name[word]) take(*flops[place]); \
    ++place;                                                                      \
  }
#include "cmodel/for_each_flop.inc"
}

std::string name_of(const Flop& flop) {
  return flop.is_array ? fmt::format("{}[{}]", flop.name, flop.word) : flop.name;
}

std::string list_differences(const chip::Chip& was, const chip::Chip& is) {
  std::string text;
  for (const FlopBlock& block : flop_blocks()) {
    for (const FlopWords& flops : block) {
      for (const Flop& flop : flops) {
        const std::uint64_t before = flop.get(was, flop.word);
        const std::uint64_t after = flop.get(is, flop.word);
        if (before != after) text += fmt::format("  {} {:#x}, was {:#x}\n", name_of(flop), after, before);
      }
    }
  }
  return text;
}

}  // namespace meltstage::tb
