// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Geometry of one depth map. `precise` keeps the compiler from fusing multiplications and
// additions, so that each device decides as the plain reference does.
#ifndef MONO3D_FUSION_OWN_PARAMS  // a stage with the same members and more
#include "fusion/view.params.h"
#endif
#include "fusion/item.glsl"

// Values of a surfel's association; any below kHidden is the index of the pixel that confirms it.
// The low 8 bits of the two that speak against it are the confidence with which they do.
const uint kUnseen = 0xFFFFFFFFu;
const uint kSeenThrough = 0xFFFFFE00u;  // the map sees past it, to a surface behind it
const uint kHidden = 0xFFFFFD00u;       // the map sees a surface before it

bool IsPixel(uint association) { return association < kHidden; }
bool Says(uint association, uint what) { return (association & 0xFFFFFF00u) == what; }

// Cells of the index map per pixel, along each axis.
const uint kIndexCellsPerPixel = 2u;

// Longest axis of a surfel over its shortest: a disc seen at 75 degrees.
const float kMaxElongation = 4.0;
const float kSqrt2 = 1.41421356;

// Quotient and remainder, by multiplication: processors have no division of whole numbers for
// vectors. `dividend` below 2^31 and 2^22 times the divisor: then the estimate is off by one at most.
uvec2 Divide(uint dividend, uint divisor) {
  int quotient = int(float(dividend) * (1.0 / float(divisor)));
  int rest = int(dividend) - quotient * int(divisor);
  const int step = rest < 0 ? -1 : (rest >= int(divisor) ? 1 : 0);
  quotient += step;
  rest -= step * int(divisor);
  return uvec2(uint(quotient), uint(rest));
}

// Column and row of a pixel by its number.
uvec2 PixelOf(uint number) { return Divide(number, params.width_px).yx; }

float Dot(vec3 a, vec3 b) {
  precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}

// The similarity from the frame of an anchor, in its unit, into the camera's, in the depth map's:
// rows of the rotation, translation, scale.
vec3 rotation_x, rotation_y, rotation_z, translation;
float scale;

// As a table of anchors has it: two vectors per anchor, a unit quaternion (w last), then translation
// and scale.
void UseAnchor(vec4 q, vec4 translation_scale) {
  precise float xx = 2.0 * q.x * q.x, yy = 2.0 * q.y * q.y, zz = 2.0 * q.z * q.z;
  precise float xy = 2.0 * q.x * q.y, xz = 2.0 * q.x * q.z, yz = 2.0 * q.y * q.z;
  precise float wx = 2.0 * q.w * q.x, wy = 2.0 * q.w * q.y, wz = 2.0 * q.w * q.z;
  precise vec3 x = vec3(1.0 - yy - zz, xy - wz, xz + wy);
  precise vec3 y = vec3(xy + wz, 1.0 - xx - zz, yz - wx);
  precise vec3 z = vec3(xz - wy, yz + wx, 1.0 - xx - yy);
  rotation_x = x;
  rotation_y = y;
  rotation_z = z;
  translation = translation_scale.xyz;
  scale = translation_scale.w;
}

vec3 DirectionToCamera(vec3 v) {
  return vec3(Dot(rotation_x, v), Dot(rotation_y, v), Dot(rotation_z, v));
}

vec3 DirectionToAnchor(vec3 v) {
  return vec3(Dot(vec3(rotation_x.x, rotation_y.x, rotation_z.x), v),
              Dot(vec3(rotation_x.y, rotation_y.y, rotation_z.y), v),
              Dot(vec3(rotation_x.z, rotation_y.z, rotation_z.z), v));
}

vec3 PointToCamera(vec3 p_anchor) {
  precise vec3 scaled = scale * p_anchor;
  precise vec3 p = DirectionToCamera(scaled) + translation;
  return p;
}

vec3 PointToAnchor(vec3 p_cam) {
  precise vec3 centred = p_cam - translation;
  precise vec3 p = DirectionToAnchor(centred) / scale;
  return p;
}

// Information on depth, 1/su^2.
float WeightToCamera(float weight_anchor) {
  precise float weight = weight_anchor / (scale * scale);
  return weight;
}
float WeightToAnchor(float weight_cam) {
  precise float weight = weight_cam * (scale * scale);
  return weight;
}

vec2 Project(vec3 p_cam) {
  precise vec2 pixel = vec2(params.fx * (p_cam.x / p_cam.z) + params.cx,
                            params.fy * (p_cam.y / p_cam.z) + params.cy);
  return pixel;
}

// The point at z = 1 on the ray of a pixel.
vec3 Ray(vec2 pixel) {
  precise vec3 ray =
      vec3((pixel.x - params.cx) / params.fx, (pixel.y - params.cy) / params.fy, 1.0);
  return ray;
}

float InverseDepthSigma(float inverse_depth) {
  return max(params.inverse_depth_sigma, params.relative_sigma * inverse_depth);
}

// How far two inverse depths, in units of one sigma of their difference, may lie apart: the one
// measured, the other of a surfel of this weight (its information on depth, 1/su^2).
// sigma(w) = sigma(z) * w^2 for the surfel.
float JointSigma(float measured_inverse_depth, float surfel_inverse_depth, float surfel_weight) {
  precise float measured = InverseDepthSigma(measured_inverse_depth);
  precise float of_surfel = surfel_inverse_depth * surfel_inverse_depth / sqrt(surfel_weight);
  precise float joint = sqrt(measured * measured + of_surfel * of_surfel);
  return joint;
}

// Inverse depth at which `ray` meets the tangent plane of a measurement: on a plane n.p = c inverse
// depth is n.ray / c. Beyond the horizon of the plane, and where the pixel sees it edge-on, the
// measurement itself.
float TangentPlaneInverseDepth(vec3 n_cam, vec3 measured_ray, float measured_inverse_depth,
                               vec3 ray) {
  precise float at_measurement = Dot(n_cam, measured_ray);
  precise float along_ray = Dot(n_cam, ray);
  if (at_measurement > -1e-3 || along_ray > -1e-3) return measured_inverse_depth;
  precise float inverse_depth = measured_inverse_depth * (along_ray / at_measurement);
  return inverse_depth;
}

// Radius of the surfel of a pixel, in su: half the diagonal of its footprint, twice over so that
// neighbouring discs overlap, and stretched on slanted surfaces.
float SurfelRadius(float depth, vec3 n_cam, vec3 ray) {
  precise float cosine = -Dot(n_cam, ray) / sqrt(Dot(ray, ray));
  precise float radius =
      kSqrt2 * depth / min(params.fx, params.fy) / max(cosine, 1.0 / kMaxElongation);
  return radius;
}
