// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// One evaluation of the registration of a depth map with the model, over every `stride`-th surfel of
// some blocks. Where the depth map is assumed to be is in the table of anchors. The first members
// are those of ViewParams.
#ifndef MONO3D_FUSION_REGISTER_PARAMS_H
#define MONO3D_FUSION_REGISTER_PARAMS_H
#include "common/params.h"

MONO3D_PARAMS_BEGIN(RegisterParams)
uint width_px;
uint height_px;
float fx;
float fy;
float cx;
float cy;
float inverse_depth_sigma;
float relative_sigma;
float association_sigmas;
float min_normal_cosine;
uint num_surfels;
uint num_blocks;    // whose surfels are looked at
uint stride;        // from one of these to the next
uint grey_level;    // of the grey image, 0 is the full size
float grey_gain;    // grey of the image = gain * grey of the surfel + bias; gain 0: depth alone
float grey_bias;
float grey_noise;     // sigma of a grey difference without texture, grey values
float grey_shift_px;  // sigma of the place at which a surfel's colour was taken
// Whether surfels that other surfels hide are left out: those far behind the nearest one of their
// cell of kNearestCell_px pixels.
uint leaves_out_hidden;
MONO3D_PARAMS_END

#endif
