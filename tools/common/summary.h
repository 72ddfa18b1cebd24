// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>

#include "mono3d/pipeline/pipeline.h"
#include "mono3d/pipeline/run_writer.h"

namespace mono3d::tools {

// Prints on stdout what a run did and where its model is.
void PrintSummary(const Reconstruction& result, const RunRecord& record,
                  const std::filesystem::path& model_path);

// Of a model half of whose surfels are less sure than a depth that is known to half a percent;
// empty of others. Such surfels are exported where hardly any are surer
// (SurfelExportOptions::min_share).
std::string WhyUncertain(const Reconstruction& result);

// Of a model none of whose depth maps was compared with another, so that its health says nothing;
// empty where some were.
std::string WhyNotConfirmed(const Reconstruction& result);

// Why there is no model; empty when there is one.
std::string WhyNoModel(const Reconstruction& result);

}  // namespace mono3d::tools
