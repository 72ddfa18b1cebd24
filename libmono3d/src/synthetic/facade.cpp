// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/facade.h"

namespace mono3d::synthetic {

using Eigen::Vector3f;

void AddSlab(Mesh& mesh, const Wall& wall, const Opening& opening, float thickness_m,
             const Finish& finish) {
  const Vector3f up = Vector3f::UnitZ();
  const Vector3f centre = wall.corner + opening.along_m * wall.along + opening.height_m * up +
                          thickness_m / 2 * wall.outwards;
  AddBlock(mesh,
           CentredBlock(centre, opening.width_m * wall.along, thickness_m * -wall.outwards,
                        opening.tall_m * up),
           finish);
}

void AddWindow(Mesh& mesh, const Wall& wall, const Opening& pane, RandomNumbers& random) {
  const Finish frame{Material::kPaint, Vector3f(0.68F, 0.67F, 0.63F), 0};
  const Finish glass{Material::kGlass, Vector3f(0.05F, 0.06F, 0.075F), random.Bits()};
  AddSlab(mesh, wall, {pane.along_m, pane.height_m, pane.width_m + 0.24F, pane.tall_m + 0.24F},
          0.05F, frame);
  AddSlab(mesh, wall, pane, 0.07F, glass);
  AddSlab(mesh, wall, {pane.along_m, pane.height_m, 0.09F, pane.tall_m}, 0.1F, frame);
  AddSlab(mesh, wall,
          {pane.along_m, pane.height_m - pane.tall_m / 2 - 0.1F, pane.width_m + 0.4F, 0.1F}, 0.2F,
          frame);
}

void AddShutters(Mesh& mesh, const Wall& wall, const Opening& pane, const Finish& finish) {
  const float width_m = pane.width_m / 2;
  for (const float side : {-1.0F, 1.0F}) {
    const float along_m = pane.along_m + side * (pane.width_m / 2 + width_m / 2 + 0.13F);
    AddSlab(mesh, wall, {along_m, pane.height_m, width_m, pane.tall_m + 0.1F}, 0.08F, finish);
  }
}

}  // namespace mono3d::synthetic
