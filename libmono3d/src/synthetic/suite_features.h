// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "synthetic/noise.h"
#include "synthetic/sequence.h"

namespace mono3d::synthetic {

// What makes the pictures of a sequence hard: "plain" (nothing), "haze", "lowsun", "overcast",
// "water", "wires", "glass", "cars". One word for each sequence of a suite, evenly often.
std::vector<std::string> DrawFeatures(std::size_t count, RandomNumbers& random);

// Throws Error on another word.
void AddFeature(SequenceOptions& options, const std::string& feature);

// A kind of scene that suits the flight (an orbit goes round something), with the feature and a
// light of its own.
void ChooseScene(SequenceOptions& options, const std::string& feature, std::size_t index);

// Noise, drift, distortion, rolling shutter and blur of a camera of chance; returns the quality of
// its JPEG, 0: not compressed.
int SpoilCamera(SequenceOptions& options, RandomNumbers& random);

}  // namespace mono3d::synthetic
