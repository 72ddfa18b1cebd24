// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "common/warnings.h"
#include "mono3d/pipeline/next_views.h"
#include "mono3d/pipeline/reconstruction.h"
#include "mono3d/pipeline/run_writer.h"
#include "run_report/run_notes.h"

namespace mono3d::tools {

// All that the report of a run tells.
struct RunReport {
  const Reconstruction& reconstruction;
  const RunRecord& record;
  const RunNotes& notes;
  std::string command;   // to run again
  std::string no_model;  // why there is none; empty where there is one
  std::vector<NotedWarning> warnings = {};
  NextViews next_views = {};  // of the first map
};

}  // namespace mono3d::tools
