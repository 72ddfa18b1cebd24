// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

// Stands before the name of the namespace in each public header: a shared library exports what is
// declared there, and nothing else. Without meaning in a static library.
#if defined(__GNUC__)
#define MONO3D_EXPORT [[gnu::visibility("default")]]
#else
#define MONO3D_EXPORT
#endif
