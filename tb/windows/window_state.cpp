// SPDX-License-Identifier: Apache-2.0
#include "tb/windows/window_state.hpp"

#include <fmt/format.h>

#include <charconv>
#include <iterator>
#include <type_traits>
#include <utility>
#include <vector>

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

// "u_uartc__DOT__u_rx" -> "u_uartc.u_rx."
std::string prefix(std::string path) {
  for (std::size_t at; (at = path.find("__DOT__")) != std::string::npos;) path.replace(at, 7, ".");
  return path + ".";
}

// The low `width` bits, as the flops hold them.
template <class T>
std::uint64_t to_bits(const void* place, unsigned width) {
  return static_cast<std::uint64_t>(*static_cast<const T*>(place)) & (~std::uint64_t{0} >> (64 - width));
}
// The model's number again: a signed one gets its sign back.
template <class T>
void from_bits(void* place, unsigned width, std::uint64_t bits) {
  if constexpr (std::is_signed_v<T>) {
    const std::uint64_t sign = std::uint64_t{1} << (width - 1);
    bits = (bits ^ sign) - sign;
  }
  *static_cast<T*>(place) = static_cast<T>(bits);
}

// A flop of a chip where it stands. Its type is left behind, so that what is done to every flop is compiled
// once for all of them and not a thousand times.
struct Flop {
  std::string name;
  unsigned width;
  void* place;
  std::uint64_t (*read)(const void* place, unsigned width);
  void (*write)(void* place, unsigned width, std::uint64_t bits);

  std::uint64_t bits() const { return read(place, width); }
  void set(std::uint64_t bits) const { write(place, width, bits); }
};

template <class T>
void add_flop(std::vector<Flop>& flops, const char* instance, std::string_view name, T& flop,
              unsigned width) {
  flops.push_back({prefix(instance).append(name), width, &flop, &to_bits<T>, &from_bits<T>});
}

template <class T>
void add_array(std::vector<Flop>& flops, const char* instance, std::string_view name, T& array,
               unsigned width) {
  for (std::size_t i = 0; i < array.size(); ++i)
    add_flop(flops, instance, fmt::format("{}[{}]", name, i), array[i], width);
}

// Every flop of the lists, in their order.
std::vector<Flop> flops_of(chip::Chip& chip) {
  std::vector<Flop> flops;
#define TC_FLOP(type, name, width, reset) \
  add_flop(flops, TC_TEXT1(TC_INSTANCE), #name, chip.TC_MEMBER.name, width);
#define TC_ARRAY(type, name, count, width) \
  add_array(flops, TC_TEXT1(TC_INSTANCE), #name, chip.TC_MEMBER.name, width);
#include "cmodel/for_each_flop.inc"
  return flops;
}

std::string state_text(const SavedState& state) {
  std::string text = fmt::format("cycle {}\n", state.cycle);
  const auto levels = pin_levels(state.before, {});
  const recording::Header header = chip_pin_header("state");
  for (std::uint32_t pin = 0; pin < kPinUartTx; ++pin)
    text += fmt::format("pin {} {}\n", header.pins[pin].name, levels[pin]);
  chip::Chip chip = state.chip;
  for (const Flop& flop : flops_of(chip))
    fmt::format_to(std::back_inserter(text), "flop {} {:x}\n", flop.name, flop.bits());
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
    for (const Flop& flop : flops_of(state.chip)) {
      const std::uint64_t bits = number(field("flop " + flop.name), 16);
      flop.set(bits);
      if (flop.bits() != bits) fail(fmt::format("a number of {} bits", flop.width));
    }
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

std::vector<FlopDifference> flop_differences(chip::Chip dut, chip::Chip model) {
  std::vector<FlopDifference> list;
  const std::vector<Flop> flops_of_model = flops_of(model);
  auto of_model = flops_of_model.begin();
  for (const Flop& of_dut : flops_of(dut)) list.push_back({of_dut.name, of_dut.bits(), (of_model++)->bits()});
  std::erase_if(list, [](const FlopDifference& d) { return d.dut == d.model; });
  return list;
}

}  // namespace meltstage::tb
