// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <span>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/triangle_mesh.h"
#include "mono3d/products/textured_mesh.h"

namespace MONO3D_EXPORT mono3d {

// An image that a mesh is textured from.
struct TextureView {
  // Reads it, CV_8UC3 (BGR), of the camera's size. Called some times, with one image in memory at a
  // time. May throw Error.
  std::function<cv::Mat()> read;
  CameraModel camera;  // with its distortion
  Pose T_world_cam;
};

struct TexturingOptions {
  int texture_side_px = 4096;  // of a texture at most; what WebGL shows everywhere
  int max_textures = 16;       // pieces of images are scaled down until they fit into these
  // Views whose texels count where one would do; 1: the best one alone. More take out noise and the
  // errors of single poses, and some of the sharpness.
  int num_blended = 1;

  void Validate() const;  // throws UsageError
};

// What texturing has come to.
struct TexturingResult {
  TexturedMesh mesh;
  std::size_t num_views = 0;    // that show at least one triangle as its best view
  std::size_t num_charts = 0;   // pieces of images
  std::size_t num_unseen = 0;   // triangles that no view shows; they have the mesh's own colours
  double texels_per_pixel = 1;  // less than 1: pieces of images were scaled down by this
};

// The mesh with textures out of the views. `surface_error_su`: how far the surface may be off, as a
// depth that does not yet hide what is behind it; the radius of its surfels. Time grows with the
// number of views times the number of triangles; memory holds one image, one texture in floats and
// twelve views per triangle. Throws Error on a mesh that is empty or damaged, without colours, and
// when no view can be read.
TexturingResult TextureMesh(const TriangleMesh& mesh, std::span<const TextureView> views,
                            double surface_error_su, const TexturingOptions& options = {});

}  // namespace mono3d
