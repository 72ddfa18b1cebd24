// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "evaluate/evaluation.h"
#include "evaluate/run_arguments.h"

namespace mono3d::tools {

// Every measure that both folders have the files for. What is left out, and why, is said in the
// page and listed in json["left_out"]. Throws Error when nothing can be compared.
Evaluation EvaluateRun(const RunArguments& arguments, bool with_pictures);

}  // namespace mono3d::tools
