// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "report/page.h"
#include "run_report/lost_frames.h"
#include "run_report/report_contents.h"

namespace mono3d::tools {

// The parts of the page of a run; a section without a title has nothing to tell.

// What went wrong or is worth a look, with the remedy.
Section NoticeSection(const RunReport& report);
Section ModelOfRunSection(const RunReport& report, const cv::Mat& overview);
Section CoverageSection(const RunReport& report);
Section FrameSection(const RunReport& report, const std::vector<FrameOutcome>& outcomes);
Section DepthOfRunSection(const RunReport& report);
// What was told of the camera, what the images say, and whether they contradict it.
Section CameraSection(const RunReport& report);
// Why a ground control point is not used, and which of its marks contradict the others; empty:
// nothing is wrong with it.
std::string FaultOf(const ControlResidual& residual);
// How sure it is where the first map is on the earth, and what the fixes differ by.
Section PositionSection(const RunReport& report);
Section TimeSection(const RunReport& report);

}  // namespace mono3d::tools
