// SPDX-License-Identifier: Apache-2.0
#include "app/live/chip_source.hpp"

#include <fmt/format.h>

#include <array>

#include "app/chip/chip_run.hpp"
#include "app/live/reading.hpp"
#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::app::live {
namespace {

// What each command does at the chip, and what is told of it.
struct AtChip {
  host::Controller& chip;

  std::string operator()(const Set& set) const {
    const std::array settings{host::Setting{set.reg, set.value}};
    chip.write(settings);
    return is_now(*set.reg, host::to_raw(*set.reg, set.value));
  }
  std::string operator()(const Run&) const {
    run_chip(chip);
    return "heating is on";
  }
  std::string operator()(const Stop&) const {
    chip.stop();
    return "the heater is off";
  }
  std::string operator()(const ClearFaults&) const {
    const std::uint16_t faults = chip.status().faults;
    chip.clear_faults();
    return faults == 0 ? "no fault was latched" : "cleared: " + host::fault_names(faults);
  }
  std::string operator()(const Tune&) const {
    chip.start_tuning();
    return "the autotune runs; Stop ends it";
  }
  std::string operator()(const BenchEvent&) const { return refuse(); }
  std::string operator()(const Speed&) const { return refuse(); }

  [[noreturn]] static std::string refuse() {
    throw UserError("a real chip has neither events nor speed, expected set, run, stop, clear or tune");
  }
};

}  // namespace

ChipSource::ChipSource(const host::Connection& connection)
    : connection_(connection), controller_(new host::Controller(connection)) {}

std::string ChipSource::place() const {
  return fmt::format("{}, address {}, {} Bd", escaped(connection_.device), connection_.address,
                     connection_.baud);
}

std::string ChipSource::connect() {
  controller_.reset();  // first: a port is opened once at a time
  controller_ = std::make_unique<host::Controller>(connection_);
  controller_->check_identity();
  return escaped(controller_->identity().text);
}

double ChipSource::now_s() { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

host::Controller& ChipSource::controller() {
  if (!controller_) throw host::BusError(connection_.device + ": is not open");
  return *controller_;
}

std::vector<std::uint16_t> ChipSource::read(std::span<const host::Register* const> wanted) {
  return controller().read(wanted);
}

std::string ChipSource::carry_out(const Command& command) {
  return std::visit(AtChip{controller()}, command.what);
}

}  // namespace meltstage::app::live
