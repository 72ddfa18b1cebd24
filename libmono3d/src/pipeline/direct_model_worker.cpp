// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/direct_model_worker.h"

namespace mono3d {

void DirectModelWorker::Add(ImageBundle bundle, KeyframePosesPtr poses) {
  builder_.Add(std::move(bundle), poses);
}

void DirectModelWorker::Update(KeyframePosesPtr poses) { builder_.Update(poses); }

}  // namespace mono3d
