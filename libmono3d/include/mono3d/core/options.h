// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

using OptionRef = std::variant<bool*, int*, double*, std::string*>;

// A word that may stand for a value of an option.
struct OptionWord {
  std::string word;
  int value = 0;
};

// One option: its dotted name ("depth.census.radius"), the variable that holds it, one line of
// help.
struct OptionField {
  std::string name;
  OptionRef value;
  std::string help;
  std::vector<OptionWord> words = {};
};

// The word for the value that the option has, where there is one.
std::optional<std::string> WordOf(const OptionField& option);

// Every options struct lists its fields once, in a member `void Visit(OptionVisitor& visit)`:
//
//   void Visit(OptionVisitor& visit) {
//     visit("num_features", num_features, "ORB features per image");
//     visit.Group("culling", culling);  // a nested options struct
//   }
//
// That one list feeds the command line, --help, the config file and the run record.
class OptionVisitor {
 public:
  template <typename T>
  void operator()(std::string_view name, T& value, std::string_view help) {
    fields_.push_back({prefix_ + std::string(name), OptionRef(&value), std::string(help)});
  }
  // Of a number for which words may stand.
  void operator()(std::string_view name, int& value, std::string_view help,
                  std::vector<OptionWord> words) {
    (*this)(name, value, help);
    fields_.back().words = std::move(words);
  }

  template <typename Options>
  void Group(std::string_view name, Options& options) {
    const std::string outer = prefix_;
    prefix_ += std::string(name) + ".";
    options.Visit(*this);
    prefix_ = outer;
  }

  const std::vector<OptionField>& fields() const { return fields_; }

 private:
  std::string prefix_;
  std::vector<OptionField> fields_;
};

// The fields of `options` and of its groups, in the order of their Visit. The references stay valid
// as long as `options` does.
template <typename Options>
std::vector<OptionField> ListOptions(Options& options) {
  OptionVisitor visitor;
  options.Visit(visitor);
  return visitor.fields();
}

// For Validate(): throws UsageError that names the option, what it must be and what it is.
void RequireOption(bool holds, std::string_view option, std::string_view expected, double found);

}  // namespace mono3d
