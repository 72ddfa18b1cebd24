// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/keyframes/keyframe_selector.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <utility>
#include <vector>

#include "keyframes/adaptive_baseline.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// A keyframe that may become part of a bundle. Where it is stands in the tracker's poses.
struct Candidate {
  Keyframe keyframe;
  double median_depth_su = 0;  // in the keyframe's own unit
};

// How the camera moved between two keyframes.
struct Motion {
  double rotation_deg = 0;
  double baseline_ratio = 0;  // over the median depth that the two see
};

Motion MotionBetween(const Candidate& a, const Candidate& b, const KeyframePoses& poses) {
  const KeyframePose& pose_a = poses.At(a.keyframe.id);
  const KeyframePose& pose_b = poses.At(b.keyframe.id);
  const Pose T_a_b = pose_a.T_world_cam().Inverse() * pose_b.T_world_cam();
  const double median_depth_world = 0.5 * (pose_a.S_world_kf.scale() * a.median_depth_su +
                                           pose_b.S_world_kf.scale() * b.median_depth_su);
  return {T_a_b.RotationAngle() * 180 / std::numbers::pi,
          T_a_b.translation().norm() / median_depth_world};
}

// The smaller angle that the image spans.
double FieldOfView_deg(const CameraModel& camera) {
  const double horizontal = 2 * std::atan2(0.5 * camera.width, camera.fx);
  const double vertical = 2 * std::atan2(0.5 * camera.height, camera.fy);
  return std::min(horizontal, vertical) * 180 / std::numbers::pi;
}

// Holds the latest keyframes and looks for a chain of num_images that ends at the newest, each
// within the limits of the one before.
class BaselineKeyframeSelector final : public KeyframeSelector {
 public:
  explicit BaselineKeyframeSelector(const KeyframeSelectorOptions& options)
      : options_(options),
        num_images_(static_cast<std::size_t>(options.num_images)),
        baseline_(options.max_baseline_ratio) {
    options_.Validate();
  }

  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses& poses) override {
    Candidate candidate{keyframe, UpperMedianOrZero(keyframe.sparse_depths_su)};
    const KeyframePose* pose = poses.Find(keyframe.id);
    if (pose == nullptr || !(candidate.median_depth_su > 0)) return std::nullopt;
    KeepMap(pose->map_id, poses);
    if (!Extend(std::move(candidate), poses)) return std::nullopt;
    return FindBundle(poses);
  }

  void ReportDepthQuality(const DepthQuality& quality) override {
    if (!options_.adapt_baseline) return;
    const auto chosen = std::find_if(chosen_.begin(), chosen_.end(), [&](const Chosen& bundle) {
      return bundle.reference_id == quality.reference_id;
    });
    if (chosen == chosen_.end()) return;
    baseline_.ReportDepthQuality(chosen->step, quality.density, quality.confidence);
    chosen_.erase(chosen_.begin(), chosen + 1);  // those before it were dropped
  }

 private:
  // Forgets the keyframes of other maps.
  void KeepMap(int map_id, const KeyframePoses& poses) {
    const auto is_elsewhere = [&](const Candidate& candidate) {
      const KeyframePose* pose = poses.Find(candidate.keyframe.id);
      return pose == nullptr || pose->map_id != map_id;
    };
    std::erase_if(window_, is_elsewhere);
    if (last_reference_ && is_elsewhere(*last_reference_)) last_reference_.reset();
  }

  bool IsNeighbour(const Motion& motion, double max_rotation_deg) const {
    return motion.rotation_deg <= max_rotation_deg &&
           motion.baseline_ratio >= options_.min_baseline_ratio &&
           motion.baseline_ratio <= options_.max_baseline_ratio;
  }

  // Appends the candidate to the window. False when it adds no baseline.
  bool Extend(Candidate candidate, const KeyframePoses& poses) {
    if (!window_.empty()) {
      const Motion motion = MotionBetween(window_.back(), candidate, poses);
      const bool is_close = motion.baseline_ratio < options_.min_baseline_ratio &&
                            motion.rotation_deg <= options_.max_rotation_deg;
      if (is_close) return false;
    }
    window_.push_back(std::move(candidate));
    // A camera that swings comes back to where it looked; what is older than that holds images.
    const std::size_t max_window = 3 * num_images_;
    if (window_.size() > max_window) window_.erase(window_.begin());
    return true;
  }

  // Indices into the window, ascending, the last one the newest.
  using Chain = std::vector<std::size_t>;

  // Of `num_images`; each step goes back as far as the
  // limits and the adaptive baseline allow, since the depth error falls with the baseline; where
  // the keyframes lie farther apart than that baseline, to the nearest. Empty when there is no
  // chain.
  Chain FindChain(const KeyframePoses& poses, std::size_t num_images,
                  double max_rotation_deg) const {
    // Of each keyframe the images of the longest chain that ends at it.
    std::vector<std::size_t> length(window_.size(), 1);
    for (std::size_t head = 0; head < window_.size(); ++head) {
      for (std::size_t i = 0; i < head; ++i) {
        const Motion motion = MotionBetween(window_[i], window_[head], poses);
        if (!IsNeighbour(motion, max_rotation_deg)) continue;
        length[head] = std::max(length[head], length[i] + 1);
      }
    }
    Chain chain = {window_.size() - 1};
    if (length.back() < num_images) return {};
    while (chain.size() < num_images) {
      const std::size_t head = chain.back();
      std::optional<std::size_t> next;
      for (std::size_t i = head; i-- > 0;) {
        if (length[i] + chain.size() < num_images) continue;
        const Motion motion = MotionBetween(window_[i], window_[head], poses);
        if (!IsNeighbour(motion, max_rotation_deg)) continue;
        if (!next || motion.baseline_ratio <= baseline_.ratio()) next = i;
      }
      chain.push_back(*next);
    }
    std::reverse(chain.begin(), chain.end());
    return chain;
  }

  Motion MotionFromLast(const Chain& chain, const KeyframePoses& poses) const {
    return MotionBetween(*last_reference_, window_[chain[chain.size() / 2]], poses);
  }

  // Where a camera that swings leaves a gap: images that are turned further against each other, as
  // long as the outermost show half of what the one in the middle shows; or else fewer images.
  Chain FindChainOverGap(const KeyframePoses& poses) const {
    const double field_deg = FieldOfView_deg(window_.back().keyframe.frame.camera);
    for (std::size_t num_images = num_images_; num_images >= 3; num_images -= 2) {
      const double steps = static_cast<double>(num_images - 1) / 2;
      const double max_rotation_deg = std::max(options_.max_rotation_deg, field_deg / 2 / steps);
      Chain chain = FindChain(poses, num_images, max_rotation_deg);
      if (chain.empty()) continue;
      if (!last_reference_) return window_.size() >= 2 * num_images_ ? chain : Chain();
      // Turned by so much, the reference shows a quarter that the last one did not.
      const Motion motion = MotionFromLast(chain, poses);
      const bool is_gap = motion.baseline_ratio >= options_.min_reference_baseline_ratio ||
                          motion.rotation_deg >= field_deg / 4;
      if (is_gap) return chain;
    }
    return {};
  }

  std::optional<ImageBundle> FindBundle(const KeyframePoses& poses) {
    Chain chain = FindChain(poses, num_images_, options_.max_rotation_deg);
    if (chain.empty()) {
      chain = FindChainOverGap(poses);
      if (chain.empty()) return std::nullopt;
    } else if (last_reference_ && MotionFromLast(chain, poses).baseline_ratio <
                                      options_.min_reference_baseline_ratio) {
      return std::nullopt;
    }
    const Candidate& reference = window_[chain[chain.size() / 2]];
    ImageBundle bundle;
    for (const std::size_t index : chain) bundle.keyframes.push_back(window_[index].keyframe);
    if (!SetPoses(poses, bundle)) return std::nullopt;  // cannot be: KeepMap
    chosen_.push_back({reference.keyframe.id, baseline_.step()});
    if (chosen_.size() > kMaxChosen) chosen_.pop_front();
    last_reference_ = reference;
    last_reference_->keyframe.frame.bgr.release();  // only its pose is needed from here on
    // The next chain ends at a newer keyframe, but its widest steps may reach back a little
    // further.
    if (chain.front() > num_images_) {
      window_.erase(window_.begin(),
                    window_.begin() + static_cast<std::ptrdiff_t>(chain.front() - num_images_));
    }
    return bundle;
  }

  // A bundle whose depth quality was not reported yet.
  struct Chosen {
    std::int64_t reference_id = 0;
    std::size_t step = 0;  // of the adaptive baseline
  };
  static constexpr std::size_t kMaxChosen = 16;  // live two are on their way

  KeyframeSelectorOptions options_;
  std::size_t num_images_;
  AdaptiveBaseline baseline_;
  std::deque<Chosen> chosen_;
  std::vector<Candidate> window_;
  std::optional<Candidate> last_reference_;
};

}  // namespace

void KeyframeSelectorOptions::Visit(OptionVisitor& visit) {
  visit("num_images", num_images, "images of an image bundle: 3, 5, 7 or 9");
  visit("max_rotation_deg", max_rotation_deg, "largest rotation between neighbouring images");
  visit("min_baseline_ratio", min_baseline_ratio,
        "smallest baseline between neighbouring images, over the median depth");
  visit("max_baseline_ratio", max_baseline_ratio,
        "largest baseline between neighbouring images, over the median depth");
  visit("adapt_baseline", adapt_baseline,
        "narrower bundles are tried after depth maps with more holes than surface");
  visit("min_reference_baseline_ratio", min_reference_baseline_ratio,
        "smallest baseline between the references of two bundles, over the median depth");
}

void KeyframeSelectorOptions::Validate() const {
  RequireOption(num_images > 0 && IsBundleSize(static_cast<std::size_t>(num_images)),
                "keyframes.num_images", kBundleSizesText, num_images);
  RequireOption(max_rotation_deg > 0 && max_rotation_deg < 90, "keyframes.max_rotation_deg",
                "more than 0 and less than 90", max_rotation_deg);
  RequireOption(min_baseline_ratio > 0, "keyframes.min_baseline_ratio", "more than 0",
                min_baseline_ratio);
  RequireOption(max_baseline_ratio > min_baseline_ratio, "keyframes.max_baseline_ratio",
                "more than keyframes.min_baseline_ratio", max_baseline_ratio);
  RequireOption(min_reference_baseline_ratio >= 0, "keyframes.min_reference_baseline_ratio",
                "0 or more", min_reference_baseline_ratio);
}

std::unique_ptr<KeyframeSelector> CreateKeyframeSelector(const KeyframeSelectorOptions& options) {
  return std::make_unique<BaselineKeyframeSelector>(options);
}

}  // namespace mono3d
