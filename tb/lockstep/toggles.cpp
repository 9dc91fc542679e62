// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/toggles.hpp"

#include <fmt/format.h>

#include <bit>
#include <sstream>
#include <utility>

#include "toggles_text.hpp"

namespace meltstage::tb {

namespace {

// "u_guard.pv_q[3]", the RTL's name of a bit, as "guard.pv_q" and its number.
std::pair<std::string, unsigned> flop_and_bit(std::string name) {
  for (std::size_t at = 0; (at = name.find("u_", at)) != std::string::npos;)
    if (at == 0 || name[at - 1] == '.')
      name.erase(at, 2);
    else
      ++at;
  const std::size_t bracket = name.rfind('[');
  if (bracket == std::string::npos) return {name, 0};
  return {name.substr(0, bracket), static_cast<unsigned>(std::stoul(name.substr(bracket + 1)))};
}

FlopToggles::Never read_never() {
  FlopToggles::Never never;
  std::istringstream lines{std::string(toggles_text::kNeverSwitch)};
  for (std::string name, word, way; lines >> name >> word >> way; ++never.count) {
    const auto [flop_name, bit] = flop_and_bit(name);
    for (const Flop* flop : flops_in_order())
      if (flop != nullptr && name_of(*flop) == flop_name)
        (way == "rises" ? never.rises : never.falls)[flop->place] |= std::uint64_t{1} << bit;
  }
  return never;
}

}  // namespace

const FlopToggles::Never& FlopToggles::never() {
  static const Never read = read_never();
  return read;
}

void FlopToggles::add(const chip::Chip& before, const chip::Inputs& in, const chip::Chip& after) {
  if (!in.rst_n) return;
  const bool works = before.out_of_reset(in);
  for_each_changed(before, after, [&](const Flop& flop) {
    // behind the synchroniser all others are in reset for some clocks more
    if (!works && !flop.name.starts_with("rst_sync.")) return;
    const std::uint64_t was = flop.get(before, flop.word), is = flop.get(after, flop.word);
    rose[flop.place] |= is & ~was;
    fell[flop.place] |= was & ~is;
  });
}

void FlopToggles::resume(const chip::Chip& state) { last_ = state; }

void FlopToggles::add(const FlopToggles& other) {
  for (std::size_t i = 0; i < kFlopPlaces; ++i) {
    rose[i] |= other.rose[i];
    fell[i] |= other.fell[i];
  }
}

std::vector<FlopToggles::Block> FlopToggles::blocks() const {
  std::vector<Block> list;
  for (const Flop* flop : flops_in_order()) {
    if (flop == nullptr) continue;
    const std::string block = flop->name.substr(0, flop->name.rfind('.'));
    if (list.empty() || list.back().name != block) list.push_back({block, 0, 0});
    list.back().bits += static_cast<unsigned>(std::popcount(flop->changeable));
    list.back().switched += static_cast<unsigned>(std::popcount(flop->changeable & ~still(*flop)));
  }
  return list;
}

std::vector<std::string> FlopToggles::still() const {
  std::vector<std::string> list;
  for (const Flop* flop : flops_in_order()) {
    for (unsigned bit = 0; flop != nullptr && bit < flop->width; ++bit) {
      if ((still(*flop) >> bit & 1) == 0) continue;
      const bool up = (rose[flop->place] >> bit & 1) != 0, down = (fell[flop->place] >> bit & 1) != 0;
      list.push_back(fmt::format("{}{}: never {}", name_of(*flop),
                                 flop->width == 1 ? "" : fmt::format("[{}]", bit),
                                 up     ? "fell"
                                 : down ? "rose"
                                        : "switched"));
    }
  }
  return list;
}

}  // namespace meltstage::tb
