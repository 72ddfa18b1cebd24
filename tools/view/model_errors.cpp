// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/model_errors.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <system_error>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d::tools {
namespace {

constexpr std::int64_t kMaxErrorSample = 20'000;  // of a model of any size

std::int64_t StepOf(std::int64_t num_vertices) {
  return std::max<std::int64_t>(1, num_vertices / kMaxErrorSample);
}

}  // namespace

ModelErrors::ModelErrors(const std::filesystem::path& path) : vertices_(path) {}

std::unique_ptr<const ModelErrors> ModelErrors::Beside(const std::filesystem::path& model_path,
                                                       const PlyVertices& model) {
  const std::filesystem::path path = model_path.parent_path() / "model_errors.ply";
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return nullptr;
  try {
    std::unique_ptr<ModelErrors> errors(new ModelErrors(path));
    if (!errors->AreOf(model)) {
      Log(LogLevel::kWarning, path.string() + ": the errors of another model, not shown");
      return nullptr;
    }
    errors->FindLargest();
    if (!(errors->largest_m_ > 0)) return nullptr;
    return errors;
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string(error.what()) + "; the errors are not shown");
    return nullptr;
  }
}

bool ModelErrors::AreOf(const PlyVertices& model) const {
  if (vertices_.size() != model.size() || !vertices_.has_errors()) return false;
  for (std::int64_t i = 0; i < model.size(); i += StepOf(model.size())) {
    if (vertices_.Point(i) != model.Point(i)) return false;
  }
  return true;
}

void ModelErrors::FindLargest() {
  std::vector<float> sample;
  for (std::int64_t i = 0; i < vertices_.size(); i += StepOf(vertices_.size())) {
    const float error_m = vertices_.Error(i);
    if (std::isfinite(error_m)) sample.push_back(error_m);
  }
  if (sample.empty()) return;
  const auto largest = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() * 49 / 50);
  std::nth_element(sample.begin(), largest, sample.end());
  largest_m_ = *largest;
}

float ModelErrors::ShareAt(std::int64_t i) const {
  const double share = vertices_.Error(i) / largest_m_;
  return std::isfinite(share) ? static_cast<float>(std::clamp(share, 0.0, 1.0)) : 1.0F;
}

}  // namespace mono3d::tools
