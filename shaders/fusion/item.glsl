// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What an invocation works on.
layout(local_size_x = 64) in;

// Surfels are worked on in blocks of neighbours, a workgroup each. All of a block have one anchor.
const uint kSurfelsPerBlock = 64u;

// More workgroups than a device takes along x continue along y.
uint WorkGroupIndex() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }

uint ItemIndex() { return WorkGroupIndex() * gl_WorkGroupSize.x + gl_LocalInvocationID.x; }

// The surfel of this invocation, in a block of this number. Lists of blocks are filled up to whole
// rows of workgroups with a number whose surfels are beyond any model.
uint SurfelOfBlock(uint block) { return block * kSurfelsPerBlock + gl_LocalInvocationID.x; }

// Pixels are worked on in blocks of as many that follow each other, where only some have an estimate.
uint PixelOfBlock(uint block) { return SurfelOfBlock(block); }
