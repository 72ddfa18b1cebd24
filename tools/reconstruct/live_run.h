// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <string>

#include "common/camera_choice.h"
#include "mono3d/geometry/camera_prior.h"
#include "mono3d/io/live_input.h"

namespace mono3d::tools {

// Connects to the camera, where `input` is one that sends now; else null. Says on stdout what
// images come. Throws Error where none come.
std::shared_ptr<LiveInput> ConnectWhereLive(const std::string& input,
                                            const LiveInputOptions& options);

// As FindPrior of a video; `live` may be null.
CameraPrior FindPriorOf(const std::string& input, const CameraArguments& arguments,
                        const LiveInput* live);

// Says on stdout how a live input went, where anything was not as it should be.
void TellOfLiveInput(const LiveInputReport& report);

}  // namespace mono3d::tools
