// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <string>
#include <vector>

#include "synthetic/flight_statistics.h"
#include "synthetic/suite_sequence.h"

namespace mono3d::synthetic {

inline constexpr std::array<const char*, 3> kSuites = {"paper51", "quick", "cameras"};

// paper51: 51 sequences that fly as those of the paper do (its Table 1), about 24,000 images in
// all. Scene, hard features, light, haze, flight and the camera's imperfections are drawn from the
// seed.
// quick: four of 40 images each, of different scenes and flights, for trying things out.
// cameras: 48 of 120 to 150 small images, from cameras of all kinds, for what learns a camera from
// its pictures: eight flights, focal lengths of 0.55 to 1.3 of the width, k1 of -0.3 to 0.1,
// principal points off by up to 2 %, shutters of 0 to 33 ms, four kinds of exposure, with and
// without H.264. Throws UsageError on another name.
std::vector<SuiteSequence> BuildSuite(const std::string& name, int seed);

// Table 1 of the paper: means, standard deviations and ranges over the frames of all sequences.
FlightStatistics PaperFlights();
inline constexpr double kPaperMeanDepth_m = 83.4;  // section 4.1
inline constexpr int kPaperImages = 24'000;

// The flights of a suite over flat ground at height 0, each frame counted once.
FlightSamples PlanFlights(const std::vector<SuiteSequence>& suite);

}  // namespace mono3d::synthetic
