// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// One depth map as every stage of fusion sees it: its camera, and what counts as equal. Lengths are
// in the own unit of its keyframe.
#ifndef MONO3D_FUSION_VIEW_PARAMS_H
#define MONO3D_FUSION_VIEW_PARAMS_H
#include "common/params.h"

MONO3D_PARAMS_BEGIN(ViewParams)
uint width_px;
uint height_px;
float fx;
float fy;
float cx;
float cy;
// The error of a measured inverse depth w is max(inverse_depth_sigma, relative_sigma * w), in 1/su.
float inverse_depth_sigma;
float relative_sigma;
float association_sigmas;
float free_space_sigmas;
float min_normal_cosine;
float max_slope_per_px;  // relative change of depth from pixel to pixel on the steepest surface
uint first_surfel;       // the slots before it are left alone by associate and free_space
uint is_past;            // 1: a map of the past, which speaks of new surfels but removes none
uint num_surfels;        // slots in use before this map
uint num_new;            // pixels that become a surfel, as insert is told
uint merge_radius_px;    // surfels stay so far apart; more than 1 where the model is too large
uint map_index;          // 0 for the first map of the model
MONO3D_PARAMS_END

#endif
