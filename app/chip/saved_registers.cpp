// SPDX-License-Identifier: Apache-2.0
#include "app/chip/saved_registers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/error.hpp"
#include "base/toml_file.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::app {

namespace {

constexpr std::array<std::string_view, 9> kNotKept{"CMD",  "SETPOINT", "MODE", "MANUAL_DUTY", "FF_EXT",
                                                   "LOCK", "ADDRESS",  "BAUD", "FORMAT"};

constexpr double kLargestValue = 1e9;  // above that of any register; host::to_raw() knows each one's range

}  // namespace

std::vector<const host::Register*> kept_registers() {
  std::vector<const host::Register*> kept;
  for (const host::Register& reg : host::registers()) {
    if (reg.writable && std::find(kNotKept.begin(), kNotKept.end(), reg.name) == kNotKept.end())
      kept.push_back(&reg);
  }
  return kept;
}

std::string saved_registers_text(std::span<const std::uint16_t> words) {
  std::string text = fmt::format(
      "# Registers of a chip, each in its unit. `meltstage chip restore` writes them back.\nmap_crc = "
      "0x{:04X}\n\n"
      "[registers]\n",
      chip::spec::kMapCrc);
  const auto kept = kept_registers();
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const host::Register& reg = *kept[i];
    text += fmt::format("{} = {}{}{}\n", reg.name, host::value_text(reg, words[i]),
                        reg.unit.empty() ? "" : "  # ", reg.unit);
  }
  return text;
}

std::vector<host::Setting> read_saved_registers(const std::filesystem::path& path) {
  const toml::table table = parse_toml(path, "registers that `chip save` wrote (TOML)");
  TomlSection top(path, &table, "");
  const std::int64_t map_crc = top.integer("map_crc", -1, 0, 0xFFFF);
  if (map_crc != chip::spec::kMapCrc)
    top.fail("map_crc", map_crc < 0 ? "none" : fmt::format("0x{:04X}", map_crc),
             fmt::format("0x{:04X}, this program's register map; save them again", chip::spec::kMapCrc));
  TomlSection section = top.section("registers");
  std::vector<host::Setting> settings;
  for (const host::Register* reg : kept_registers()) {
    if (!section.has(reg->name)) section.fail(reg->name, "none", "every register that is kept");
    const double value = section.number(reg->name, 0.0, -kLargestValue, kLargestValue);
    try {
      host::to_raw(*reg, value);
    } catch (const UserError& error) {
      // which begins with the register's name, as the place ends with it
      throw UserError(section.place_of(reg->name) + std::string(error.what()).substr(reg->name.size()));
    }
    settings.push_back({reg, value});
  }
  section.finish();
  top.finish();
  return settings;
}

}  // namespace meltstage::app
