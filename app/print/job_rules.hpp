// SPDX-License-Identifier: Apache-2.0
// What the fields of a job have to do with each other. A chip would refuse such a job by a number, or never
// print it; here the field is named.
#pragma once

#include <vector>

#include "base/toml_file.hpp"
#include "tb/printer/printer.hpp"

namespace meltstage::app {

// Sections that set registers; [registers] beats the others.
struct RegisterSections {
  const TomlSection& head;
  const TomlSection& temperature;
  const TomlSection& registers;
};

// Throws UserError for a set-point that the chip would not take, that the head can't come to or that the
// sensor doesn't measure, for a control period in which the sensor has no new reading, and for a chip that
// locks its host out.
void require_printable(const tb::PrintJob& job, const chip::spec::SensorPreset& sensor,
                       const RegisterSections& sections);

// Where a good droplet may land at the most: a quarter of the way between the two bumps that are nearest to
// each other, but no more than 100 um and no less than 10 um.
double default_place_tolerance_mm(const std::vector<motion::Point>& bumps);

}  // namespace meltstage::app
