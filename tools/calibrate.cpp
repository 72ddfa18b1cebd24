// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-calibrate: the camera of an image folder, a glob or a video.

#include <cstdio>
#include <optional>
#include <string>

#include "calibrate/calibration_report.h"
#include "common/camera_choice.h"
#include "common/input_check.h"
#include "common/scene_mask.h"
#include "common/tool.h"
#include "mono3d/calibration/board_calibration.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  std::string input;
  std::string output;
  std::string report;  // folder; empty: none
  CameraArguments camera;
  FrameSourceOptions source;
  MaskArguments mask;
  std::string chessboard;  // "9x6"; empty: none
  std::string charuco;     // "7x5"; empty: none
  CalibrationBoard board;
};

// "9x6" of the option.
void ParseBoardSize(const std::string& option, const std::string& text, CalibrationBoard& board) {
  int end = 0;
  const int num_read = std::sscanf(text.c_str(), "%4dx%4d%n", &board.columns, &board.rows, &end);
  if (num_read == 2 && end == static_cast<int>(text.size())) return;
  throw UsageError(ErrorParts{
      .what = "bad size of a board", .where = option, .expected = "COLUMNSxROWS", .found = text});
}

// The board to look for; nothing: any scene will do.
std::optional<CalibrationBoard> BoardOf(const Arguments& arguments) {
  CalibrationBoard board = arguments.board;
  if (!arguments.chessboard.empty()) {
    ParseBoardSize("--board", arguments.chessboard, board);
  } else if (!arguments.charuco.empty()) {
    board.kind = BoardKind::kCharuco;
    ParseBoardSize("--charuco", arguments.charuco, board);
  } else {
    return std::nullopt;
  }
  board.Validate();
  return board;
}

CameraCalibration Learn(const Arguments& arguments, const std::optional<CalibrationBoard>& board) {
  if (!board) {
    // Not held, so that the images are asked.
    return *ChooseCamera(arguments.input, arguments.source, arguments.camera).calibration;
  }
  return CalibrateFromBoard(FindPrior(arguments.input, arguments.camera),
                            OpenerOf(arguments.input, arguments.source), *board);
}

int Calibrate(Arguments& arguments) {
  arguments.source.Validate();
  arguments.camera.calibration.Validate();
  const std::optional<CalibrationBoard> board = BoardOf(arguments);
  const CameraModel prior = FindPrior(arguments.input, arguments.camera).camera;
  RequireImagesOfPlaces(arguments.input, prior, arguments.source);
  RequireWritableFile(arguments.output);
  TellOfTurn(arguments.input);
  // A board is found by its looks, wherever it is; a mask that is told is used.
  if (!board || arguments.mask.source != MaskArguments().source) {
    arguments.source.hidden = FindHidden(arguments.input, arguments.mask, prior, arguments.source,
                                         /*is_live=*/false);
  }
  const CameraCalibration calibration = Learn(arguments, board);
  if (!calibration.is_learned && !AgreesWithCalibration(calibration)) {
    throw Error(arguments.input + ": no camera can be learned: " + calibration.reason);
  }
  std::printf("%s", CalibrationText(calibration).c_str());
  WriteCameraFile(arguments.output, calibration.posterior.camera);
  if (!arguments.report.empty()) WriteCalibrationReport(arguments.report, calibration);
  return 0;
}

void AddArguments(Tool& tool, Arguments& arguments) {
  CLI::App& app = tool.app();
  app.add_option("INPUT", arguments.input,
                 "image folder, quoted glob (\"flight/*.jpg\") or video file")
      ->required();
  app.add_option("-o,--output", arguments.output, "file for the calibration: camera.yaml")
      ->required();
  app.add_option("--camera", arguments.camera.file,
                 "what is known before: OpenCV or ROS camera.yaml, or COLMAP cameras.txt; without "
                 "it metadata of the input, or a usual lens");
  AddLensOption(app, arguments.camera);
  app.add_option("--report", arguments.report,
                 "folder for calibration.json and pictures of the residuals");
  CLI::Option* chessboard =
      app.add_option("--board", arguments.chessboard,
                     "the input shows a chessboard with this many inner corners, as 9x6");
  CLI::Option* charuco =
      app.add_option("--charuco", arguments.charuco,
                     "the input shows a ChArUco board of this many squares, as 7x5");
  charuco->excludes(chessboard);
  app.add_option("--dictionary", arguments.board.dictionary,
                 "of the markers of the ChArUco board, as OpenCV calls it")
      ->capture_default_str()
      ->needs(charuco);
  app.add_option("--marker-share", arguments.board.marker_share,
                 "side of a marker of the ChArUco board as a share of that of a square")
      ->capture_default_str()
      ->needs(charuco);
  tool.AddOptions(mono3d::ListOptions(arguments.source));
  tool.AddOptions(mono3d::ListOptions(arguments.mask));
  arguments.camera.calibration.max_share = 1;  // no run waits for it
  tool.AddOptions(mono3d::ListOptions(arguments.camera.calibration), "calibration.");
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-calibrate",
            "Learns the lens of a camera from footage of a textured scene, or of a calibration "
            "board.\n"
            "Example: mono3d-calibrate flight/ -o camera.yaml",
            ToolKind::kWithoutDevice);
  Arguments arguments;
  AddArguments(tool, arguments);
  return tool.Run(argc, argv, [&] { return Calibrate(arguments); });
}
