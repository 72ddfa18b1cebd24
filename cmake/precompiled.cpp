// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The precompiled headers need a target, and the target a source: see mono3d_precompiled.cmake.
