// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The one form of a stage's parameters, read by C++ and GLSL alike. A file
// shaders/<module>/<stage>.params.h says
//
//   #include "common/params.h"
//   MONO3D_PARAMS_BEGIN(CensusParams)
//   uint width_px;
//   float ref_from_src[12];
//   MONO3D_PARAMS_END
//
// In C++ that is `struct mono3d::CensusParams`, the argument of Recorder::Dispatch; in GLSL it is
// the push-constant block, read as `params.width_px`. Members are uint, int, float or arrays of
// them: 4-byte scalars lie the same in both languages, vectors and matrices do not.
#ifndef MONO3D_COMMON_PARAMS_H
#define MONO3D_COMMON_PARAMS_H

#ifdef __cplusplus

#include <cstdint>

#define MONO3D_PARAMS_BEGIN(Name) \
  namespace mono3d {              \
  struct Name {                   \
    using uint = std::uint32_t;
#define MONO3D_PARAMS_END \
  }                       \
  ;                       \
  }

#else

#define MONO3D_PARAMS_BEGIN(Name) layout(push_constant) uniform Name {
#define MONO3D_PARAMS_END \
  }                       \
  params;

#endif

#endif
