// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A selector that is saved and restored after each keyframe does, to the bit, what one does that is
// not.

#include <gmock/gmock.h>

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/state_sections.h"
#include "image/image_state.h"
#include "image/state_archive.h"
#include "keyframes/posed_views.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr const char* kStateWhere = "run.state";

// One that no keyframe has to itself: what is restored must still be right.
cv::Mat StateImage(std::int64_t index) {
  cv::Mat image(kViewCamera.height, kViewCamera.width, CV_8UC3, cv::Scalar::all(0));
  image.at<cv::Vec3b>(0, 0)[0] = static_cast<std::uint8_t>(index);
  return image;
}

// More than the window holds: sideways, a turn, a place that hardly moves, other ground.
std::vector<PosedKeyframe> StatePath() {
  std::vector<PosedKeyframe> keyframes;
  for (std::int64_t id = 0; id < 56; ++id) {
    const auto number = static_cast<double>(id);
    const double ratio = id < 25 ? 0.05 * number : id < 45 ? 1.25 + 0.004 * number : 0.1 * number;
    keyframes.push_back(MakeKeyframe(id, ratio, id % 20 < 10 ? 0 : 3));
    keyframes.back().keyframe.frame.index = 3 * id;
    keyframes.back().keyframe.frame.bgr = StateImage(3 * id);
  }
  return keyframes;
}

std::string StateBytesOf(std::vector<ImageBundle> bundles) {
  StateWriter writer("bundles", 1, SavedImages::kIncluded);
  for (ImageBundle& bundle : bundles) {
    std::size_t reference = bundle.reference_index();
    writer.Index(reference);
    for (Keyframe& keyframe : bundle.keyframes) ExchangeState(writer, keyframe);
    for (Pose& pose : bundle.T_ref_cam) ExchangeState(writer, pose);
  }
  return writer.TakeState();
}

void Damage(std::string& bytes, std::size_t place) {
  char& damaged = bytes[place % bytes.size()];
  damaged = static_cast<char>(damaged ^ 0x55);
}

struct SelectorRun {
  std::vector<std::string> bytes;  // of the bundle after each keyframe, and of those at the end
  std::string end_state;
  std::size_t num_bundles = 0;
};

// `is_relay`: after each keyframe another selector goes on, which has nothing but the state.
SelectorRun SelectAll(bool is_relay, SavedImages images, const KeyframeSelectorOptions& options) {
  std::unique_ptr<KeyframeSelector> selector = CreateKeyframeSelector(options);
  SelectorRun run;
  std::vector<KeyframePose> poses;
  std::int64_t num_reported = 0;
  for (const PosedKeyframe& posed : StatePath()) {
    poses.push_back(posed.pose);
    const auto bundle = selector->Add(posed.keyframe, {poses.size(), poses});
    run.bytes.push_back(StateBytesOf(bundle ? std::vector{*bundle} : std::vector<ImageBundle>()));
    run.num_bundles += bundle ? 1 : 0;
    // Full of holes at first, none at all once, then good: all that is adapted to them.
    if (bundle && bundle->reference().id % 4 != 3) {
      const double density = ++num_reported < 5 ? 0.3 : num_reported == 7 ? 0 : 0.9;
      selector->ReportDepthQuality({bundle->reference().id, density, 0.1 + 0.7 * density});
    }
    if (!is_relay || (images == SavedImages::kIncluded && posed.pose.keyframe_id % 16 != 0)) {
      continue;
    }
    const std::string state = selector->SaveState(images);
    std::unique_ptr<KeyframeSelector> next = CreateKeyframeSelector(options);
    next->RestoreState(state, kStateWhere,
                       images == SavedImages::kByIndex ? StateImage : ImageOfFrame());
    EXPECT_TRUE(next->SaveState(images) == state);
    EXPECT_EQ(next->Findings(), selector->Findings());
    selector = std::move(next);
  }
  run.end_state = selector->SaveState(SavedImages::kByIndex);
  const std::vector<ImageBundle> last = selector->Finish({poses.size(), poses});
  run.bytes.push_back(StateBytesOf(last));
  run.num_bundles += last.size();
  run.end_state += selector->Findings() + selector->SaveState(SavedImages::kByIndex);
  return run;
}

TEST(KeyframeSelectorState, GoesOnAfterEachKeyframe) {
  for (const bool is_unordered : {false, true}) {
    KeyframeSelectorOptions options;
    options.is_unordered = is_unordered;
    const SelectorRun whole = SelectAll(false, SavedImages::kByIndex, options);
    EXPECT_GT(whole.num_bundles, 8U);
    for (const SavedImages images : {SavedImages::kByIndex, SavedImages::kIncluded}) {
      if (is_unordered && images == SavedImages::kIncluded) continue;  // nothing else than before
      const SelectorRun relay = SelectAll(true, images, options);
      EXPECT_EQ(relay.num_bundles, whole.num_bundles);
      EXPECT_TRUE(relay.bytes == whole.bytes);
      EXPECT_TRUE(relay.end_state == whole.end_state);
    }
  }
}

TEST(KeyframeSelectorState, IsRefusedWhenForeignDamagedOrOfOtherOptions) {
  TrackedSelector selector;
  for (const PosedKeyframe& posed : StatePath()) static_cast<void>(selector.Add(posed));
  const std::string state = selector->SaveState(SavedImages::kByIndex);
  const auto restore = [](std::string bytes, const KeyframeSelectorOptions& options = {}) {
    return [bytes = std::move(bytes), options] {
      CreateKeyframeSelector(options)->RestoreState(bytes, kStateWhere, StateImage);
    };
  };
  EXPECT_NO_THROW(restore(state)());
  EXPECT_THAT(restore("solid cube"), ThrowsMessage<Error>(HasSubstr("not one of mono3d")));
  for (std::size_t size = 1; size < state.size(); size += state.size() / 100) {
    EXPECT_THROW(restore(state.substr(0, size))(), Error) << size;
    std::string changed = state;
    changed[size] = static_cast<char>(changed[size] ^ 4);
    EXPECT_THROW(restore(changed)(), Error) << size;
  }
  // Changed with their checksums: whatever is accepted can be gone on with.
  const std::vector<StateSection> sections = SectionsOf(state, "state", kStateWhere);
  for (std::size_t at = 1; at < sections.size(); ++at) {
    std::string bytes;
    for (std::size_t i = 0; i < sections.size(); ++i) {
      std::string content(sections[i].bytes.substr(2 * sizeof(std::uint64_t)));
      if (i == at && !content.empty()) Damage(content, 37 * at);
      bytes += ToSection(content);
    }
    try {
      restore(bytes)();
    } catch (const Error&) {
      continue;
    }
  }
  KeyframeSelectorOptions options;
  options.num_images = 7;
  EXPECT_THAT(restore(state, options),
              ThrowsMessage<UsageError>(HasSubstr("keyframes.num_images 5, found")));
  EXPECT_THAT([&] { selector->RestoreState(state, kStateWhere, StateImage); },
              ThrowsMessage<UsageError>(HasSubstr("before the first keyframe")));
}

}  // namespace
}  // namespace mono3d
