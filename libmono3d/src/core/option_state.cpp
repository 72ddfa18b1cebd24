// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/option_state.h"

#include <cstdio>
#include <variant>

namespace mono3d {
namespace {

std::string ExactText(const std::string* value) { return *value; }
std::string ExactText(const bool* value) { return *value ? "true" : "false"; }
std::string ExactText(const int* value) { return std::to_string(*value); }
std::string ExactText(const double* value) {
  char number[32];
  std::snprintf(number, sizeof number, "%.17g", *value);
  return number;
}

}  // namespace

std::string NameAndValue(const OptionField& option) {
  return option.name + " " +
         std::visit([](const auto* value) { return ExactText(value); }, option.value);
}

}  // namespace mono3d
