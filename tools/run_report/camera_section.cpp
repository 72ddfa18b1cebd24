// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <array>
#include <cmath>

#include "common/camera_choice.h"
#include "run_report/run_sections.h"

namespace mono3d::tools {
namespace {

struct CameraRow {
  const char* name;
  double prior = 0, prior_sigma = 0;
  double learned = 0, sigma = 0;
  bool is_determined = false;
  int digits = 1;
};

std::string WithSigma(double value, double sigma, int digits) {
  return FormatFixed(value, digits) + " ± " + FormatFixed(sigma, digits);
}

void AddRow(const CameraRow& row, Table& table) {
  table.rows.push_back({row.name, WithSigma(row.prior, row.prior_sigma, row.digits),
                        WithSigma(row.learned, row.sigma, row.digits),
                        row.is_determined ? "the images" : "what was known before"});
}

Table CameraTable(const CameraCalibration& calibration, const std::string& title) {
  const CameraPrior& prior = calibration.prior;
  const CameraPrior& learned = calibration.posterior;
  Table table;
  table.title = title;
  table.columns = {"", "before", "used", "determined by"};
  AddRow(
      {"focal length, px", prior.camera.fx, prior.camera.fx * prior.focal_sigma, learned.camera.fx,
       learned.camera.fx * learned.focal_sigma, calibration.determines_focal_length},
      table);
  AddRow(
      {"principal point x, px", prior.camera.cx, prior.principal_point_sigma_px, learned.camera.cx,
       learned.principal_point_sigma_px, calibration.determines_principal_point},
      table);
  AddRow(
      {"principal point y, px", prior.camera.cy, prior.principal_point_sigma_px, learned.camera.cy,
       learned.principal_point_sigma_px, calibration.determines_principal_point},
      table);
  const std::vector<std::string> names = DistortionNames(learned.camera.lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    AddRow({names[i].c_str(), prior.camera.distortion.at(i), prior.distortion_sigma.at(i),
            learned.camera.distortion.at(i), learned.distortion_sigma.at(i),
            calibration.determines_distortion.at(i), 4},
           table);
  }
  AddRow({"rolling shutter, ms", 1e3 * prior.camera.shutter.readout_s, 1e3 * prior.readout_sigma_s,
          1e3 * learned.camera.shutter.readout_s, 1e3 * learned.readout_sigma_s,
          calibration.determines_readout},
         table);
  return table;
}

std::string VerdictOf(const CameraCalibration& calibration) {
  const bool is_told = calibration.prior.source == CameraPriorSource::kCalibration;
  if (calibration.contradicts_prior) {
    return "The images contradict what was known of the camera, by " +
           FormatFixed(calibration.change_px, 1) + " px; what they say is used.";
  }
  if (calibration.is_learned) {
    return is_told ? "The images agree with the calibration, and tell more of it."
                   : "The camera was learned from the images.";
  }
  return "The camera is as it was known before: " + calibration.reason + ".";
}

}  // namespace

Section CameraSection(const RunReport& report) {
  const RunRecord& record = report.record;
  Section section;
  section.title = "The camera";
  if (record.calibration) {
    const CameraCalibration& calibration = *record.calibration;
    const std::string from = calibration.prior.description.empty()
                                 ? std::string(ToString(calibration.prior.source))
                                 : calibration.prior.description;
    section.paragraphs = {VerdictOf(calibration)};
    const std::string variation = VariationText(calibration.variation);
    if (!variation.empty()) section.paragraphs.push_back(variation + ".");
    section.tables = {CameraTable(calibration, "Known before: " + from)};
    section.tables.back().notes = {"By this camera, the pixel that shows a point is known to " +
                                   FormatFixed(calibration.uncertainty_px, 1) +
                                   " px or better anywhere in the image."};
  } else if (!record.cameras.empty()) {
    section.paragraphs = {"The photographs are of " + std::to_string(record.cameras.size()) +
                          " cameras, zooms or sizes."};
    for (std::size_t i = 0; i < record.cameras.size(); ++i) {
      const CameraOfRun& camera = record.cameras[i];
      section.folded_tables.push_back(CameraTable(
          camera.calibration, "Camera " + std::to_string(i + 1) + " " + camera.name + ", " +
                                  std::to_string(camera.num_photos) + " photographs"));
    }
  } else if (!record.camera.empty()) {
    section.paragraphs = {"The calibration " + record.camera +
                          " was held, and the images were not asked (--camera-fixed)."};
  } else {
    section.paragraphs = {"The run ended before the images were asked of their camera."};
  }
  return section;
}

}  // namespace mono3d::tools
