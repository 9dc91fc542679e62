// SPDX-License-Identifier: Apache-2.0
// The syntax of a Liberty file, whatever its groups mean.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/place.hpp"

namespace meltstage::liberty {

/// `name : value ;` has one value, `name (value, value) ;` any number. Without quotes.
struct Attribute {
  std::string name;
  std::vector<std::string> values;
  Place place;
};

/// `name (argument, argument) { ... }`.
struct Group {
  std::string name;
  std::vector<std::string> arguments;  ///< without quotes
  std::vector<Attribute> attributes;
  std::vector<Group> groups;
  Place place;

  /// The first of that name; null when there is none.
  const Attribute* find(std::string_view attribute) const;
  /// The same. Throws UserError when it is said again with another value; `file` stands in the message.
  const Attribute* only(std::string_view attribute, const std::string& file) const;
  const Group* find_group(std::string_view group) const;
  /// The first argument, or nothing.
  std::string label() const;
  /// The first value of an attribute, or nothing.
  std::string text(std::string_view attribute) const;
  /// The first value of an attribute as a finite number; 0 without one. Throws UserError; `file` stands in
  /// messages.
  double number(std::string_view attribute, const std::string& file) const;
  /// All numbers of a list such as index_1 ("1, 2, 3"). Throws UserError.
  std::vector<double> numbers(std::string_view attribute, const std::string& file) const;
};

/// Reads the library group. Groups may stand 32 deep. Throws UserError.
Group parse(std::string_view text, const std::string& file);

}  // namespace meltstage::liberty
