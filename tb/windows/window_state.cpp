// SPDX-License-Identifier: Apache-2.0
#include "tb/windows/window_state.hpp"

#include <fmt/format.h>

#include <charconv>
#include <iterator>
#include <type_traits>
#include <utility>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/output_file.hpp"
#include "base/place.hpp"
#include "base/sha256.hpp"
#include "tb/pins/chip_pins.hpp"

#define TC_TEXT2(x) #x
#define TC_TEXT1(x) TC_TEXT2(x)

namespace meltstage::tb {

namespace {

namespace spec = chip::spec;  // the flop lists are written inside meltstage::chip

constexpr std::string_view kMagic = "meltstage-state 1";

template <unsigned width>
using Width = std::integral_constant<unsigned, width>;

// "u_uartc__DOT__u_rx" -> "u_uartc.u_rx."
std::string prefix(std::string path) {
  for (std::size_t at; (at = path.find("__DOT__")) != std::string::npos;) path.replace(at, 7, ".");
  return path + ".";
}

// Calls visit(name, flop, Width) for every flop of the lists, in their order.
template <class Chip, class Visit>
void for_each_flop(Chip& chip, Visit visit) {
#define TC_FLOP(type, name, width, reset) \
  visit(prefix(TC_TEXT1(TC_INSTANCE)) + #name, chip.TC_MEMBER.name, Width<width>{});
#define TC_ARRAY(type, name, count, width)                                                             \
  for (std::size_t i = 0; i < chip.TC_MEMBER.name.size(); ++i)                                         \
    visit(prefix(TC_TEXT1(TC_INSTANCE)) + #name "[" + std::to_string(i) + "]", chip.TC_MEMBER.name[i], \
          Width<width>{});
#include "cmodel/for_each_flop.inc"
}

// The low `width` bits, as the flops hold them.
template <class T, unsigned width>
std::uint64_t to_bits(T value, Width<width>) {
  return static_cast<std::uint64_t>(value) & (~std::uint64_t{0} >> (64 - width));
}
// The model's number again: a signed one gets its sign back.
template <class T, unsigned width>
T from_bits(std::uint64_t bits, Width<width>) {
  if constexpr (std::is_signed_v<T>) {
    constexpr std::uint64_t kSign = std::uint64_t{1} << (width - 1);
    return static_cast<T>(static_cast<std::int64_t>((bits ^ kSign) - kSign));
  } else {
    return static_cast<T>(bits);
  }
}

std::string state_text(const SavedState& state) {
  std::string text = fmt::format("cycle {}\n", state.cycle);
  const auto levels = pin_levels(state.before, {});
  const recording::Header header = chip_pin_header("state");
  for (std::uint32_t pin = 0; pin < kPinUartTx; ++pin)
    text += fmt::format("pin {} {}\n", header.pins[pin].name, levels[pin]);
  for_each_flop(state.chip, [&](const std::string& name, const auto& flop, auto width) {
    fmt::format_to(std::back_inserter(text), "flop {} {:x}\n", name, to_bits(flop, width));
  });
  return text;
}

// Takes a state file apart, line by line.
class StateReader {
 public:
  StateReader(const std::filesystem::path& path, std::string text) : path_(path), text_(std::move(text)) {}

  SavedState read() {
    check_hash();
    if (line() != kMagic) fail(kMagic);
    BuildIdentity made_by;
    made_by.build = field("build");
    made_by.spec = field("spec");
    require_this_build(path_, made_by);

    SavedState state;
    state.cycle = number(field("cycle"), 10);
    std::array<std::uint64_t, kChipPinCount> levels{};
    const recording::Header header = chip_pin_header("state");
    for (std::uint32_t pin = 0; pin < kPinUartTx; ++pin)
      levels[pin] = number(field("pin " + header.pins[pin].name), 10);
    state.before = inputs_of(levels);
    for_each_flop(state.chip, [&](const std::string& name, auto& flop, auto width) {
      const std::uint64_t bits = number(field("flop " + name), 16);
      if (to_bits(bits, width) != bits) fail(fmt::format("a number of {} bits", width()));
      flop = from_bits<std::remove_reference_t<decltype(flop)>>(bits, width);
    });
    state.chip.mem.refresh_params();
    if (at_ != end_) fail("nothing behind the last flop");
    return state;
  }

 private:
  [[noreturn]] void fail(std::string_view expected) const {
    throw UserError(fmt::format("{}:{}: found \"{}\", expected {}; plan again", path_.string(), number_,
                                shown(line_), expected));
  }
  void check_hash() {
    constexpr std::string_view kKey = "sha256 ";
    const std::size_t last = text_.size() < 2 ? std::string::npos : text_.rfind('\n', text_.size() - 2);
    if (last == std::string::npos || text_.compare(last + 1, kKey.size(), kKey) != 0) {
      throw UserError(
          fmt::format("{}: truncated, expected a last line \"sha256 ...\"; plan again", path_.string()));
    }
    end_ = last + 1;
    const std::string found = sha256(std::string_view(text_).substr(0, end_));
    if (text_.substr(end_) != std::string(kKey) + found + "\n") {
      throw UserError(
          fmt::format("{}: damaged: its content has SHA-256 {}..., its last line says {}...; plan again",
                      path_.string(), found.substr(0, 12), shown(text_.substr(end_ + kKey.size(), 12))));
    }
  }
  std::string_view line() {
    ++number_;
    const std::size_t begin = std::min(at_, end_);
    const std::size_t newline = std::min(text_.find('\n', begin), end_);
    line_ = std::string_view(text_).substr(begin, newline - begin);
    at_ = std::min(newline + 1, end_);
    return line_;
  }
  std::string field(const std::string& key) {
    const std::string_view text = line();
    if (!text.starts_with(key + " ")) fail("\"" + key + " ...\"");
    return std::string(text.substr(key.size() + 1));
  }
  std::uint64_t number(const std::string& text, int base) const {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
    if (error != std::errc{} || end != text.data() + text.size()) fail("a number");
    return value;
  }

  std::filesystem::path path_;
  std::string text_;
  std::string_view line_;
  std::size_t at_ = 0;
  std::size_t end_ = 0;
  std::size_t number_ = 0;
};

}  // namespace

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.finish();
}

const BuildIdentity& this_build() {
  static const BuildIdentity identity{
      sha256(read_file("/proc/self/exe", "this program")),
      fmt::format("version {:#06x} crc {:#06x}", spec::kVersion, spec::kMapCrc)};
  return identity;
}

void require_this_build(const std::filesystem::path& file, const BuildIdentity& made_by) {
  if (made_by.spec != this_build().spec) {
    throw UserError(fmt::format("{}: made for another spec: found register map {}, expected {}; plan again",
                                file.string(), shown(made_by.spec), this_build().spec));
  }
  if (made_by.build != this_build().build) {
    throw UserError(fmt::format(
        "{}: made by another build: found executable {}..., expected {}...; plan again or use that build",
        file.string(), shown(made_by.build.substr(0, 12)), this_build().build.substr(0, 12)));
  }
}

std::string state_hash(const SavedState& state) { return sha256(state_text(state)); }

void write_state(const std::filesystem::path& path, const SavedState& state) {
  std::string text = fmt::format("{}\nbuild {}\nspec {}\n{}", kMagic, this_build().build, this_build().spec,
                                 state_text(state));
  text += fmt::format("sha256 {}\n", sha256(text));
  OutputFile file(path);
  file.write(text);
  file.publish();
}

SavedState read_state(const std::filesystem::path& path) {
  return StateReader(path, read_file(path, kPlanFile)).read();
}

std::vector<FlopDifference> flop_differences(const chip::Chip& a, const chip::Chip& b) {
  std::vector<FlopDifference> list;
  for_each_flop(a, [&](const std::string& name, const auto& flop, auto width) {
    list.push_back({name, to_bits(flop, width), 0});
  });
  std::size_t next = 0;
  for_each_flop(b, [&](const std::string&, const auto& flop, auto width) {
    list[next++].model = to_bits(flop, width);
  });
  std::erase_if(list, [](const FlopDifference& d) { return d.dut == d.model; });
  return list;
}

}  // namespace meltstage::tb
