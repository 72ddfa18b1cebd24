// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

namespace mono3d::tools {

// What the paper states of itself (its Tables 2 to 4 and the text of its evaluation), lengths in
// metres.
struct PaperFigures {
  const char* name;
  double mean_depth_m;
  double trajectory_rmse_m;  // Table 2, after registration with the model
  double trajectory_mae_m;
  double trajectory_sigma_m;
  double depth_rmse_m;  // Table 3
  double depth_mae;     // relative
  double delta_125;
  double delta_105;
  double model_rmse_m;  // Table 4
  double model_sigma_rmse_m;
};

inline constexpr PaperFigures kPaperSynthetic = {
    "paper, synthetic", 83.4, 1.481, 1.235, 0.800, 11.406, 0.034, 0.974, 0.876, 0.744, 0.616};
inline constexpr PaperFigures kPaperReal = {"paper, real", 11.5,  0.577, 0.519, 0.251, 0.966,
                                            0.035,         0.984, 0.831, 0.141, 0.033};

// Of the synthetic sequences: 47 of 51.
inline constexpr int kPaperNumSequences = 51;
inline constexpr int kPaperNumSuccesses = 47;
inline constexpr double kPaperMsPerDepthMap = 220;  // at 768x448 on a GTX 1080 Ti
inline constexpr double kPaperShareOfFramesUsed = 0.0203;

}  // namespace mono3d::tools
