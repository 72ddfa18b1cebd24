// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/keyframes/keyframe_selector.h"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <numbers>
#include <utility>
#include <vector>

#include "core/option_state.h"
#include "geometry/geometry_state.h"
#include "image/image_state.h"
#include "image/state_archive.h"
#include "keyframes/adaptive_baseline.h"
#include "keyframes/reference_spacing.h"
#include "keyframes/source_choice.h"
#include "keyframes/view.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr const char* kSelectorState = "keyframe selector state";
constexpr std::uint32_t kSelectorStateVersion = 2;

constexpr std::size_t kMaxNumViews = 40;
constexpr std::size_t kMaxImageBytes = 256'000'000;

// Of the outermost angle that is aimed for: what comes later is hardly better.
constexpr double kWideShare = 0.8;

// New surface that justifies a weak bundle, whose depth map would disturb a better one's.
constexpr double kMinNewShareOfWeak = 0.5;

std::size_t BytesOf(const View& view) {
  const cv::Mat& image = view.keyframe().frame.bgr;
  return image.total() * image.elemSize();
}

// Holds the latest keyframes. Each waits to become a reference until no better sources are to be
// expected among the next keyframes. Bundles with good sources on both sides are made then. Where
// there are none it is looked at once more when the window holds as many later keyframes as earlier
// ones, or at the end; other bundles are made only of what none has shown by then.
class ViewSelector final : public KeyframeSelector {
 public:
  explicit ViewSelector(const KeyframeSelectorOptions& options)
      : options_(options),
        baseline_(options.best_angle_deg),
        spacing_(options.min_reference_baseline_ratio, options.min_new_share) {
    options_.Validate();
  }

  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses& poses) override {
    View view(keyframe);
    if (poses.Find(keyframe.id) == nullptr || view.points().empty()) return std::nullopt;
    ForgetWithoutPose(poses);
    ++num_keyframes_;
    if (!AddsNothing(view, poses)) {
      NoteFindings(view, poses);
      window_.push_back({std::move(view)});
      if (!options_.is_unordered) Trim();
    }
    if (options_.is_unordered) return std::nullopt;
    if (auto bundle = TakeSettled(poses)) return bundle;
    return TakePassed(poses);
  }

  std::vector<ImageBundle> Finish(const KeyframePoses& poses) override {
    ForgetWithoutPose(poses);
    std::vector<ImageBundle> bundles;
    for (std::size_t i = 0; i < window_.size(); ++i) {
      if (window_[i].state == State::kDone) continue;
      if (auto bundle = TakeIfGood(i, poses)) bundles.push_back(*std::move(bundle));
    }
    while (auto bundle = TakeNewest(poses)) bundles.push_back(*std::move(bundle));
    window_.clear();
    return bundles;
  }

  void ReportDepthQuality(const DepthQuality& quality) override {
    if (!(quality.density > 0)) spacing_.NoteNoDepth(quality.reference_id);
    if (!options_.adapt_baseline) return;
    const auto chosen = std::find_if(chosen_.begin(), chosen_.end(), [&](const Chosen& bundle) {
      return bundle.reference_id == quality.reference_id;
    });
    if (chosen == chosen_.end()) return;
    baseline_.ReportDepthQuality(chosen->step, quality.density, quality.confidence);
    chosen_.erase(chosen_.begin(), chosen + 1);  // those before it were dropped
  }

  std::string SaveState(SavedImages images) const override {
    StateWriter writer(kSelectorState, kSelectorStateVersion, images);
    const_cast<ViewSelector&>(*this).ExchangeState(writer);  // a writer changes nothing
    return writer.TakeState();
  }

  void RestoreState(std::string_view bytes, const std::string& where,
                    const ImageOfFrame& images) override {
    if (num_keyframes_ > 0) throw UsageError("a state must be restored before the first keyframe");
    StateReader reader(bytes, kSelectorState, kSelectorStateVersion, where, images);
    ExchangeState(reader);
    reader.CheckEnd();
  }

  // The cause first: it is what a person reads.
  std::string Findings() const override {
    char text[256];
    const auto num_keyframes = static_cast<long long>(num_keyframes_);
    if (has_bundle_) {
      std::snprintf(text, sizeof text, "%lld keyframes, baseline %.4f of the depth at most",
                    num_keyframes, widest_baseline_ratio_);
    } else if (num_keyframes < 3) {
      std::snprintf(text, sizeof text, "%lld keyframes, and three that show the same are needed",
                    num_keyframes);
    } else if (!has_common_view_) {
      std::snprintf(text, sizeof text,
                    "the images are too far apart: no two of the %lld keyframes show the same",
                    num_keyframes);
    } else if (widest_baseline_ratio_ < options_.min_baseline_ratio) {
      std::snprintf(text, sizeof text,
                    "the camera hardly moved sideways: baseline %.4f of the depth at most, %.4f "
                    "are needed (%lld keyframes)",
                    widest_baseline_ratio_, options_.min_baseline_ratio, num_keyframes);
    } else {
      std::snprintf(
          text, sizeof text,
          "the images are too far apart: the nearest two of the %lld keyframes show the "
          "same at %.0f degrees (baseline %.2f of the depth), %.0f at most can be matched",
          num_keyframes, narrowest_angle_deg_, narrowest_baseline_ratio_, options_.max_angle_deg);
    }
    return text;
  }

 private:
  enum class State {
    kOpen,    // waits for better sources
    kPassed,  // had none on both sides
    kDone,    // is a reference, or like one
  };

  struct Waiting {
    View view;
    State state = State::kOpen;
  };

  // All members.
  template <typename Archive>
  void ExchangeState(Archive& archive) {
    ExchangeOptions(archive, ListOptions(options_), "keyframes.");
    bool is_unordered = options_.is_unordered;
    archive.Number(is_unordered);
    baseline_.ExchangeState(archive);
    spacing_.ExchangeState(archive);
    std::vector<Chosen> chosen(chosen_.begin(), chosen_.end());
    archive.List(chosen, [&](Chosen& bundle) {
      archive.Number(bundle.reference_id);
      archive.Index(bundle.step);
    });
    archive.Sections(window_, 1, [&](Waiting& waiting) {
      waiting.view.ExchangeState(archive);
      auto state = static_cast<std::uint8_t>(waiting.state);
      archive.Number(state);
      waiting.state = static_cast<State>(state);
    });
    archive.Number(is_full_);
    ExchangeCount(archive, num_keyframes_);
    archive.Number(widest_baseline_ratio_);
    archive.Number(narrowest_angle_deg_);
    archive.Number(narrowest_baseline_ratio_);
    archive.Number(has_common_view_);
    archive.Number(has_bundle_);
    if constexpr (Archive::kReads) {
      chosen_ = {chosen.begin(), chosen.end()};
      const auto is_choice = [&](const Chosen& bundle) { return baseline_.HasStep(bundle.step); };
      const auto is_waiting = [](const Waiting& waiting) {
        return waiting.state <= State::kDone && !waiting.view.points().empty() &&
               !waiting.view.keyframe().frame.bgr.empty();
      };
      if (is_unordered != options_.is_unordered || chosen_.size() > kMaxChosen ||
          !std::ranges::all_of(chosen_, is_choice) || !std::ranges::all_of(window_, is_waiting)) {
        archive.Refuse("contradicts itself");
      }
    }
  }

  int NumLater(std::size_t index) const { return static_cast<int>(window_.size() - 1 - index); }

  SourceChoiceOptions ChoiceOptions() const {
    return {.num_sources = static_cast<std::size_t>(options_.num_images - 1),
            .step_deg = baseline_.angle_deg(),
            .max_angle_deg = options_.max_angle_deg,
            .min_baseline_ratio = options_.min_baseline_ratio};
  }

  // Keyframes that the tracker has taken out of its map.
  void ForgetWithoutPose(const KeyframePoses& poses) {
    std::erase_if(window_,
                  [&](const Waiting& waiting) { return poses.Find(waiting.view.id()) == nullptr; });
  }

  // Are there as many from about the same place as a bundle has?
  bool AddsNothing(const View& view, const KeyframePoses& poses) const {
    const auto is_close = [&](const Waiting& waiting) {
      if (!AreInOneMap(view, waiting.view, poses)) return false;
      const Pose T_a_b =
          poses.At(view.id()).T_world_cam().Inverse() * poses.At(waiting.view.id()).T_world_cam();
      return BaselineRatio(view, waiting.view, poses) < options_.min_baseline_ratio &&
             T_a_b.RotationAngle() < options_.best_angle_deg * std::numbers::pi / 180;
    };
    return std::ranges::count_if(window_, is_close) >= options_.num_images;
  }

  void NoteFindings(const View& view, const KeyframePoses& poses) {
    if (has_bundle_) return;
    for (const Waiting& waiting : window_) {
      if (!AreInOneMap(view, waiting.view, poses)) continue;
      const CommonView common = Compare(view, waiting.view, poses);
      if (common.angles_deg.empty()) continue;
      has_common_view_ = true;
      widest_baseline_ratio_ = std::max(widest_baseline_ratio_, common.baseline_ratio);
      if (common.angle_deg >= narrowest_angle_deg_) continue;
      narrowest_angle_deg_ = common.angle_deg;
      narrowest_baseline_ratio_ = common.baseline_ratio;
    }
  }

  void Trim() {
    std::size_t num_bytes = 0;
    for (const Waiting& waiting : window_) num_bytes += BytesOf(waiting.view);
    const auto least = 3 * static_cast<std::size_t>(options_.num_images);
    while (window_.size() > kMaxNumViews ||
           (num_bytes > kMaxImageBytes && window_.size() > least)) {
      num_bytes -= BytesOf(window_.front().view);
      window_.pop_front();
    }
    is_full_ = is_full_ || window_.size() == kMaxNumViews || num_bytes > kMaxImageBytes;
  }

  // Later keyframes will hardly bring better sources: there are as many as belong on one side and
  // the outermost is far enough away, or the newest one shows something else.
  bool IsSettled(std::size_t index, const KeyframePoses& poses) const {
    const View& reference = window_[index].view;
    const int num_later = NumLater(index);
    if (num_later == 0) return false;
    if (num_later >= 2 * options_.num_images) return true;
    const View& newest = window_.back().view;
    if (!AreInOneMap(reference, newest, poses)) return true;
    const int per_side = options_.num_images / 2;
    const CommonView common = Compare(reference, newest, poses);
    if (!IsUsable(common, options_.max_angle_deg)) return true;
    return num_later >= per_side &&
           common.angle_deg >= kWideShare * per_side * baseline_.angle_deg();
  }

  std::optional<ImageBundle> TakeSettled(const KeyframePoses& poses) {
    for (std::size_t i = 0; i < window_.size(); ++i) {
      if (window_[i].state != State::kOpen || !IsSettled(i, poses)) continue;
      if (auto bundle = TakeIfGood(i, poses)) return bundle;
    }
    return std::nullopt;
  }

  std::optional<ImageBundle> TakeIfGood(std::size_t index, const KeyframePoses& poses) {
    Waiting& waiting = window_[index];
    if (spacing_.HasLike(waiting.view, poses)) {
      waiting.state = State::kDone;
      return std::nullopt;
    }
    const std::optional<SourceChoice> sources = SourcesOf(index, poses);
    if (!sources || sources->grade != SourceGrade::kGood) {
      waiting.state = State::kPassed;
      return std::nullopt;
    }
    return Take(index, *sources, poses);
  }

  // Of those that were passed and that the window will soon have no earlier ones of.
  std::optional<ImageBundle> TakePassed(const KeyframePoses& poses) {
    if (!is_full_) return std::nullopt;
    for (std::size_t i = 0; i <= window_.size() / 2; ++i) {
      if (window_[i].state != State::kPassed) continue;
      if (auto bundle = TakeIfGood(i, poses)) return bundle;
      if (window_[i].state != State::kPassed) continue;
      const std::optional<SourceChoice> sources = SourcesOf(i, poses);
      const bool is_worth_it = sources && NewShareOf(i, sources->grade, poses) > 0;
      window_[i].state = State::kDone;
      if (is_worth_it) return Take(i, *sources, poses);
    }
    return std::nullopt;
  }

  // At the end, of those that were passed: the one that shows the most that is new.
  std::optional<ImageBundle> TakeNewest(const KeyframePoses& poses) {
    std::optional<SourceChoice> best;
    std::size_t best_index = 0;
    double most = 0;
    for (std::size_t i = 0; i < window_.size(); ++i) {
      if (window_[i].state != State::kPassed) continue;
      const std::optional<SourceChoice> sources = SourcesOf(i, poses);
      const double share = sources ? NewShareOf(i, sources->grade, poses) : 0;
      if (share <= most) {
        if (share == 0) window_[i].state = State::kDone;  // nor will it be later
        continue;
      }
      best = sources;
      best_index = i;
      most = share;
    }
    if (!best) return std::nullopt;
    return Take(best_index, *best, poses);
  }

  // 0 where it is too little for a bundle of that grade.
  double NewShareOf(std::size_t index, SourceGrade grade, const KeyframePoses& poses) const {
    const double share = spacing_.NewShare(window_[index].view, poses);
    const double least = grade == SourceGrade::kWeak ? kMinNewShareOfWeak : options_.min_new_share;
    return share >= least ? share : 0;
  }

  std::optional<SourceChoice> SourcesOf(std::size_t index, const KeyframePoses& poses) const {
    std::vector<const View*> views;
    for (const Waiting& waiting : window_) views.push_back(&waiting.view);
    return ChooseSources(views, index, poses, ChoiceOptions());
  }

  std::optional<ImageBundle> Take(std::size_t index, const SourceChoice& sources,
                                  const KeyframePoses& poses) {
    Waiting& waiting = window_[index];
    waiting.state = State::kDone;
    ImageBundle bundle;
    for (const std::size_t i : sources.first) {
      bundle.keyframes.push_back(window_[i].view.keyframe());
    }
    bundle.num_first_side = bundle.keyframes.size();
    bundle.keyframes.push_back(waiting.view.keyframe());
    for (const std::size_t i : sources.second) {
      bundle.keyframes.push_back(window_[i].view.keyframe());
    }
    if (!SetPoses(poses, bundle)) return std::nullopt;  // cannot be: AreInOneMap
    spacing_.Add(waiting.view);
    // The others do not show what the angle between neighbours does.
    if (sources.grade == SourceGrade::kGood) {
      chosen_.push_back({waiting.view.id(), baseline_.step()});
      if (chosen_.size() > kMaxChosen) chosen_.pop_front();
    }
    widest_baseline_ratio_ = has_bundle_ ? std::max(widest_baseline_ratio_, sources.baseline_ratio)
                                         : sources.baseline_ratio;
    has_bundle_ = true;
    return bundle;
  }

  // A bundle whose depth quality was not reported yet.
  struct Chosen {
    std::int64_t reference_id = 0;
    std::size_t step = 0;  // of the adaptive baseline
  };
  static constexpr std::size_t kMaxChosen = 16;  // live two are on their way

  KeyframeSelectorOptions options_;
  AdaptiveBaseline baseline_;
  ReferenceSpacing spacing_;
  std::deque<Chosen> chosen_;
  std::deque<Waiting> window_;  // in the order of the keyframes
  bool is_full_ = false;        // the window: the oldest was or will be forgotten
  // For Findings: of all pairs before the first bundle, of the bundles from then on.
  std::int64_t num_keyframes_ = 0;
  double widest_baseline_ratio_ = 0;
  double narrowest_angle_deg_ = 180;
  double narrowest_baseline_ratio_ = 0;  // of the same pair
  bool has_common_view_ = false;
  bool has_bundle_ = false;
};

}  // namespace

std::string KeyframeSelector::SaveState(SavedImages /*images*/) const {
  throw Error("this selector cannot save its state: a run with it cannot be resumed");
}

void KeyframeSelector::RestoreState(std::string_view /*bytes*/, const std::string& where,
                                    const ImageOfFrame& /*images*/) {
  throw Error(ErrorParts{.what = "this selector cannot restore a state: begin the run anew",
                         .where = where,
                         .expected = {},
                         .found = {}});
}

void KeyframeSelectorOptions::Visit(OptionVisitor& visit) {
  visit("num_images", num_images, "images of an image bundle: 3, 5, 7 or 9; fewer where there are");
  visit("best_angle_deg", best_angle_deg,
        "angle between neighbouring images at the points they share, aimed for");
  visit("max_angle_deg", max_angle_deg,
        "largest angle between an image and the reference at the points they share");
  visit(
      "min_baseline_ratio", min_baseline_ratio,
      "baseline between neighbouring images over the median depth; less only where all have less");
  visit("adapt_baseline", adapt_baseline,
        "narrower bundles are tried after depth maps with more holes than surface");
  visit("min_reference_baseline_ratio", min_reference_baseline_ratio,
        "baseline between the references of two bundles over the median depth; less only where the "
        "second one shows something new");
  visit("min_new_share", min_new_share, "share of the picture that such new surface takes, 0 to 1");
}

void KeyframeSelectorOptions::Validate() const {
  RequireOption(num_images > 0 && IsBundleSize(static_cast<std::size_t>(num_images)),
                "keyframes.num_images", kBundleSizesText, num_images);
  RequireOption(best_angle_deg > 0 && best_angle_deg < 90, "keyframes.best_angle_deg",
                "more than 0 and less than 90", best_angle_deg);
  RequireOption(max_angle_deg >= best_angle_deg && max_angle_deg < 90, "keyframes.max_angle_deg",
                "keyframes.best_angle_deg or more, and less than 90", max_angle_deg);
  RequireOption(min_baseline_ratio > 0, "keyframes.min_baseline_ratio", "more than 0",
                min_baseline_ratio);
  RequireOption(min_reference_baseline_ratio >= 0, "keyframes.min_reference_baseline_ratio",
                "0 or more", min_reference_baseline_ratio);
  RequireOption(min_new_share > 0 && min_new_share <= 1, "keyframes.min_new_share",
                "more than 0, 1 at most", min_new_share);
}

std::unique_ptr<KeyframeSelector> CreateKeyframeSelector(const KeyframeSelectorOptions& options) {
  return std::make_unique<ViewSelector>(options);
}

}  // namespace mono3d
