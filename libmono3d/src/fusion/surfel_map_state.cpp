// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/surfel_map_state.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <sstream>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "fusion/state_archive.h"
#include "mono3d/core/error.h"
#include "mono3d/core/options.h"

namespace mono3d {
namespace {

// Of all that fusion keeps.
constexpr std::uint32_t kModelStateVersion = 3;

std::string OptionText(const OptionRef& value) {
  return std::visit(
      [](const auto* variable) -> std::string {
        using T = std::remove_cvref_t<decltype(*variable)>;
        if constexpr (std::is_same_v<T, std::string>) {
          return *variable;
        } else if constexpr (std::is_same_v<T, bool>) {
          return *variable ? "true" : "false";
        } else {
          std::array<char, 40> text{};  // the shortest that is the number again
          const auto end = std::to_chars(text.data(), text.data() + text.size(), *variable);
          return {text.data(), end.ptr};
        }
      },
      value);
}

// One line per option. Where the surfels are makes no difference to what they are.
std::string TextOfOptions(SurfelMapOptions options) {
  std::string text;
  for (const OptionField& field : ListOptions(options)) {
    if (field.name.starts_with("storage.")) continue;
    text += "fusion." + field.name + " = " + OptionText(field.value) + "\n";
  }
  return text;
}

void RequireSameOptions(const std::string& saved, const std::string& now,
                        const std::string& where) {
  if (saved == now) return;
  std::istringstream saved_lines(saved);
  std::istringstream lines(now);
  std::string saved_line;
  std::string line;
  while (std::getline(saved_lines, saved_line) && std::getline(lines, line) && saved_line == line) {
  }
  throw Error(ErrorParts{.what = "saved surfel model: made with other options; go on with those",
                         .where = where,
                         .expected = saved_line,
                         .found = line,
                         .code = ErrorCode::kInvalidArgument});
}

struct Counts {
  std::uint64_t num_past_views = 0;
};

// All but surfels and images.
template <typename Archive>
void ExchangeRest(Archive& archive, const SurfelMapParts& parts, Counts& counts) {
  parts.model.anchors.Exchange(archive);
  parts.merger.Exchange(archive);
  parts.placer.Exchange(archive);
  parts.fuser.Exchange(archive);
  parts.changes.Exchange(archive);
  parts.vignetting.Exchange(archive);
  archive.Optional(parts.map_id, [&](int& id) { archive.Number(id); });
  archive.Number(counts.num_past_views);
}

}  // namespace

void SurfelMapState::Save(const SurfelMapParts& parts, StateFolder& folder,
                          const std::string& name) {
  // Those of a call that was cut off by an exception are told of by nobody else.
  parts.changes.Changed(parts.merger.TakeChangedAnchors());
  ByteWriter writer;
  std::uint32_t version = kModelStateVersion;
  std::string options = TextOfOptions(parts.context.options);
  writer.Number(version);
  writer.Text(options);
  folder.Put(name + "/made_with", writer.TakeBytes());

  auto& past_views = parts.fuser.past_views().views();
  Counts counts{past_views.size()};
  ExchangeRest(writer, parts, counts);
  PutInPieces(folder, name + "/rest", writer.TakeBytes());
  for (std::size_t i = 0; i < past_views.size(); ++i) {
    PastViews::Exchange(writer, past_views[i], parts.context.device);
    PutInPieces(folder, name + "/past_view/" + std::to_string(i), writer.TakeBytes());
  }
  for (std::size_t i = 0; i < parts.vignetting.num_views(); ++i) {
    parts.vignetting.ExchangeView(writer, i);
    PutInPieces(folder, name + "/vignetting/" + std::to_string(i), writer.TakeBytes());
  }
  surfels_.Save(parts.model.surfels, parts.changes, folder, name + "/surfels");
  inferred_.Save(parts.model.inferred, parts.changes, folder, name + "/inferred");
}

void SurfelMapState::Restore(const SurfelMapParts& parts, const StateFolder& folder,
                             const std::string& name) {
  const std::string where = folder.path().string();
  const auto read = [&](const std::string& part, const auto& exchange) {
    const std::string bytes = GetFromPieces(folder, name + part);
    ByteReader reader(bytes, kSavedModel, where);
    exchange(reader);
    RequireSound(reader, reader.IsAtEnd());
  };
  const std::string made_with = folder.Get(name + "/made_with");
  ByteReader reader(made_with, kSavedModel, where);
  std::uint32_t version = 0;
  reader.Number(version);
  if (version != kModelStateVersion) {
    throw Error(ErrorParts{.what = "saved surfel model: of another version; go on with the mono3d "
                                   "that wrote it",
                           .where = where,
                           .expected = "version " + std::to_string(kModelStateVersion),
                           .found = "version " + std::to_string(version)});
  }
  std::string options;
  reader.Text(options);
  RequireSameOptions(options, TextOfOptions(parts.context.options), where);

  Counts counts;
  read("/rest", [&](ByteReader& rest) { ExchangeRest(rest, parts, counts); });
  RequireSound(reader, counts.num_past_views <=
                           static_cast<std::uint64_t>(parts.context.options.num_reviews));
  auto& past_views = parts.fuser.past_views().views();
  past_views.clear();
  for (std::uint64_t i = 0; i < counts.num_past_views; ++i) {
    PastView& view = past_views.emplace_back();
    read("/past_view/" + std::to_string(i), [&](ByteReader& past) {
      PastViews::Exchange(past, view, parts.context.device);
      RequireSound(past, view.anchor < parts.model.anchors.size());
    });
  }
  for (std::size_t i = 0; i < parts.vignetting.num_views(); ++i) {
    read("/vignetting/" + std::to_string(i),
         [&](ByteReader& view) { parts.vignetting.ExchangeView(view, i); });
  }
  const std::uint32_t num_anchors = parts.model.anchors.size();
  surfels_.Restore(folder, name + "/surfels", num_anchors, parts.changes, parts.model.surfels);
  inferred_.Restore(folder, name + "/inferred", num_anchors, parts.changes, parts.model.inferred);
}

}  // namespace mono3d
