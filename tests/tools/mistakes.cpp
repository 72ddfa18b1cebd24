// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tools/mistakes.h"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tools/command.h"

namespace mono3d {
namespace {

std::string CalibrationText(int width, int height, const std::string& fx = "60.") {
  return "%YAML:1.0\n---\nimage_width: " + std::to_string(width) +
         "\nimage_height: " + std::to_string(height) +
         "\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ " + fx +
         ", 0., 31.5, 0., 60., 23.5, 0., 0., 1. ]\n";
}

void WriteNoise(const std::filesystem::path& path, int seed, int width = 64) {
  cv::Mat image(48, width, CV_8UC3);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  std::filesystem::create_directories(path.parent_path());
  cv::imwrite(path.string(), image);
}

}  // namespace

void WriteFilesOfMistakes(const std::filesystem::path& folder) {
  const auto write = [&](const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder / name).parent_path());
    WriteText(folder / name, text);
  };
  for (int i = 0; i < 5; ++i) {
    const std::string number = std::to_string(i);
    WriteNoise(folder / "flight" / (number + ".jpg"), i + 1);
    WriteNoise(folder / "stamped" / "images" / (number + ".jpg"), i + 1);
    WriteNoise(folder / "card" / "100MEDIA" / (number + ".jpg"), i + 1);
    WriteNoise(folder / "card" / "101MEDIA" / (number + ".jpg"), i + 1);
    WriteNoise(folder / "same" / (number + ".jpg"), 1);
    WriteNoise(folder / "two_sizes" / (number + ".png"), i + 1, i < 3 ? 64 : 32);
    write("raw/IMG_" + number + ".DNG", "raw");
    write("text/" + number + ".jpg", "I am no image.\n");
  }
  write("cut/0.jpg", ReadText(folder / "flight/0.jpg").substr(0, 900));
  std::string damaged = ReadText(folder / "flight/0.jpg");
  // Many ones are no code.
  for (std::size_t i = 0; i < 20; ++i) damaged.replace(1500 + 2 * i, 2, std::string("\xFF\0", 2));
  write("damaged/0.jpg", damaged);
  WriteNoise(folder / "one/a.jpg", 1);
  std::filesystem::create_directories(folder / "empty");
  write("stamped/timestamps.txt", "0\n0.1\n");
  write("camera.yaml", CalibrationText(64, 48));
  write("larger.yaml", CalibrationText(128, 96));
  write("turned.yaml", CalibrationText(48, 64));
  write("nan.yaml", CalibrationText(64, 48, ".Nan"));
  write("misspelt.yaml", "image_width: 64\nimage_height: 48\ncamera_matrx: 3\n");
  write("empty.mp4", "");
  write("text.mp4", "I am no video.\n");
  write("broken.mp4", std::string("\0\0\0\x18", 4) + "ftypisom" + std::string(4, '\0') +
                          "isomavc1" + std::string("\0\0\x10\0", 4) + "mdat" +
                          std::string(2000, 'x'));
  write("file", "I am no folder.\n");
  write("notes.txt", "Flew at noon.\n");
  write("options.txt", "keyframes.num_image = 3\n");
  write("older.map", "mono3d map\n" + std::string("\x03\0\0\0", 4));
  write("poses.txt", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n");
  write("bent.txt", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 2\n");
  write("words.txt", "0 0 0 0 0 0 0 1\n1 1 0 zero 0 0 0 1\n");
  write("later.txt", "100 0 0 0 0 0 0 1\n101 1 0 0 0 0 0 1\n102 1 1 0 0 0 0 1\n");
  write(
      "cut.ply",
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n0 0 0\n");
  write("run/trajectory.txt", ReadText(folder / "poses.txt"));
  write("measured/groundtruth.txt", ReadText(folder / "poses.txt"));
  write("finished/model.ply", ReadText(folder / "cut.ply"));
  write("exchanged.csv", "timestamp,lat,lon,alt\n0,138.6,-34.9,120\n1,138.6,-34.91,120\n");
  for (int i = 0; i < 12; ++i) {
    WriteNoise(folder / "twelve" / (std::to_string(i) + ".jpg"), i + 1);
  }
}

const std::vector<Mistake>& Mistakes() {
  static const std::vector<Mistake> all = {
      // The command line.
      {"no input", "reconstruct -o out", 2, "INPUT", "--help"},
      {"no output folder", "reconstruct flight", 2, "--output", "--help"},
      {"a misspelt option", "reconstruct flight -o out --mehs", 2, "--mehs",
       "did you mean --mesh?"},
      {"an option that is not there", "reconstruct flight -o out --quality high", 2, "--quality",
       "--help"},
      {"an option without its value", "reconstruct flight -o out --stride", 2, "--stride",
       "--help"},
      {"no value behind a =", "reconstruct flight --camera= -o out", 2,
       "--camera: its value is missing", "--help"},
      {"an option in place of a value", "reconstruct flight --camera -o out", 2,
       "--camera: its value is missing", "-o comes next"},
      {"a word for a number", "reconstruct flight -o out --stride two", 2, "--stride", "two"},
      {"a number out of its range", "reconstruct flight -o out --stride 0", 2, "--stride",
       "1 or more"},
      {"a rate below 0", "reconstruct flight -o out --fps -1", 2, "fps", "0 or more"},
      {"a size that is none", "reconstruct flight -o out --resize big", 2, "--resize",
       "WIDTHxHEIGHT"},
      {"a lens that is not there", "reconstruct flight -o out --lens wide", 2, "--lens", "fisheye"},
      {"axes that are not there", "reconstruct flight -o out --axes up", 2, "--axes",
       "first-camera"},
      {"depth files of an unknown form", "reconstruct flight -o out --depth-files tiff", 2,
       "--depth-files", "png16"},
      {"an option of a stage out of its range",
       "reconstruct flight -o out --keyframes.best_angle_deg 200", 2, "--keyframes.best_angle_deg",
       "found 200"},
      {"options that exclude each other",
       "reconstruct flight --camera camera.yaml -o out --live "
       "--photos --camera-fixed",
       2, "photographs", "--live"},
      {"a file of options that is not there", "reconstruct flight -o out --config none.txt", 2,
       "none.txt", "--help"},
      {"a misspelt name in a file of options", "reconstruct flight -o out --config options.txt", 2,
       "keyframes.num_image", "--help"},
      // The input.
      {"a misspelt folder", "reconstruct fligth -o out", 1, "fligth: there is no such",
       "an image folder"},
      {"a stream that is not there", "reconstruct rtsp://pilot:secret@127.0.0.1:9/live -o out", 1,
       "rtsp://127.0.0.1:9/live: no video comes", "ffplay"},
      {"a stream without its port", "reconstruct udp://127.0.0.1 -o out", 2,
       "udp://127.0.0.1: the address cannot be understood", "udp://HOST:PORT"},
      {"a stream of another kind", "reconstruct http://10.0.0.1/live -o out", 1,
       "only rtsp://, rtsps://, udp:// and tcp:// are read",
       "ffmpeg -i 'http://10.0.0.1/live' -c copy -t 60 flight.mp4"},
      {"a stream to learn the camera from", "calibrate rtsp://10.0.0.1/live -o camera.yaml", 1,
       "only mono3d-reconstruct reads a camera that sends now",
       "ffmpeg -i 'rtsp://10.0.0.1/live' -t 60 flight.mp4"},
      {"a camera that is not there", "reconstruct /dev/video99 -o out", 1,
       "/dev/video99: there is no such camera", "ls /dev/video*"},
      {"a camera's number", "reconstruct 0 -o out", 1, "named as /dev/video0", "/dev/video0"},
      {"a mask that is not there", "reconstruct flight -o out --mask bonnet.png", 2,
       "bonnet.png: there is no such mask", "an image that is black where no scene is"},
      {"a mask of other images", "reconstruct flight -o out --mask two_sizes/4.png", 2,
       "two_sizes/4.png: the mask has another shape", "expected 64x48, found 32x48"},
      {"an empty folder", "reconstruct empty -o out", 1, "empty: there are no images",
       "found an empty folder"},
      {"a folder of folders", "reconstruct card -o out", 1, "card: there are no images",
       "the folders 100MEDIA (5 images), 101MEDIA (5 images): name one of them"},
      {"a folder of raw photographs", "reconstruct raw -o out", 1,
       "5 .DNG files, which are not read", "develop them to JPEG"},
      {"a raw photograph", "reconstruct raw/IMG_0.DNG -o out", 1, ".DNG images are not read",
       "develop them to JPEG"},
      {"a pattern without quotes", "reconstruct flight/*.jpg -o out", 2,
       "5 files where one input is expected", "quote the pattern, as \"flight/*.jpg\""},
      {"a pattern that nothing matches", "reconstruct 'flight/*.tif' -o out", 1,
       "flight/*.tif: no image matches", ".tif"},
      {"one image", "reconstruct flight/0.jpg -o out", 1, "flight/0.jpg: too few images",
       "name a folder"},
      {"a folder of one image", "reconstruct one -o out", 1, "one: too few images", "3 or more"},
      {"too few images are left", "reconstruct flight -o out --max-frames 2", 1, "too few images",
       "--max-frames"},
      {"copies of one image", "reconstruct same -o out", 1, "all images show the same",
       "take them from the video again"},
      {"no image that can be read", "reconstruct text -o out", 1, "not one image can be read",
       "text"},
      {"a start behind the end", "reconstruct flight -o out --start 9", 1,
       "no image is left to read", "a start below 5"},
      {"time stamps of fewer images", "reconstruct stamped --camera camera.yaml -o out", 1,
       "timestamps.txt: wrong number of timestamps", "expected 5, one for each image"},
      {"an empty video", "reconstruct empty.mp4 -o out", 1, "empty.mp4: the file is empty",
       "copy it again"},
      {"a text named as a video", "reconstruct text.mp4 -o out", 1,
       "text.mp4: cannot open the video", "FFmpeg can read"},
      {"a recording that broke off", "reconstruct broken.mp4 -o out", 1,
       "broken.mp4: cannot open the video", "index is missing"},
      {"a text as input", "reconstruct notes.txt -o out", 1,
       "notes.txt: neither images nor a video", "an image folder, a glob"},
      // The calibration.
      {"images and calibration in the wrong order",
       "reconstruct camera.yaml --camera flight -o out", 1,
       "flight: cannot read it as a calibration", "images or a video are the input"},
      {"a calibration as the input", "reconstruct camera.yaml -o out", 1,
       "camera.yaml: neither images nor a video", "--camera"},
      {"a calibration without its option", "reconstruct flight camera.yaml -o out", 2,
       "camera.yaml was not expected", "--camera camera.yaml"},
      {"an image as calibration", "reconstruct flight --camera flight/0.jpg -o out", 1,
       "flight/0.jpg: cannot read it as a calibration", "camera.yaml"},
      {"a calibration that is not there", "reconstruct flight --camera none.yaml -o out", 1,
       "none.yaml", "no such file"},
      {"a calibration of another size",
       "reconstruct flight --camera larger.yaml --camera-fixed -o out", 1,
       "image has another size than the calibration", "--resize"},
      {"a calibration of images that were turned",
       "reconstruct flight --camera turned.yaml --camera-fixed -o out", 1,
       "the calibration is of images that were turned", "leave out --camera"},
      {"a misspelt key in a calibration", "reconstruct flight --camera misspelt.yaml -o out", 1,
       "misspelt.yaml", "camera_matrix"},
      {"a calibration without numbers", "reconstruct flight --camera nan.yaml -o out", 1,
       "nan.yaml", "expected"},
      {"a calibration of another lens",
       "reconstruct flight --camera camera.yaml --lens fisheye -o out", 2,
       "camera.yaml: the calibration is of another lens", "expected fisheye"},
      // Maps and results.
      {"a map without its camera", "reconstruct flight --map older.map -o out", 2, "--map",
       "--camera with its calibration"},
      {"a map that is not there", "reconstruct flight --map none.map --camera camera.yaml -o out",
       1, "none.map", "no such file"},
      {"a map of an older version",
       "reconstruct flight --map older.map --camera camera.yaml -o out", 1,
       "older.map: saved map: of another version", "make it again"},
      {"no map", "reconstruct flight --map notes.txt --camera camera.yaml -o out", 1, "notes.txt",
       "--save-map"},
      {"a map into a folder that is not there",
       "reconstruct flight --save-map none/flight.map -o out", 1, "none/flight.map", "cannot"},
      {"a file in place of the output folder", "reconstruct flight -o file", 1, "file", "folder"},
      {"an output folder that cannot be written", "reconstruct flight -o /proc/out", 1, "/proc/out",
       "cannot"},
      {"the images' own folder for the output", "reconstruct flight -o flight", 2, "--output",
       "name another folder"},
      {"two videos", "reconstruct text.mp4 broken.mp4 -o out", 2, "broken.mp4 was not expected",
       "join the videos"},
      {"a calibration before the images", "reconstruct camera.yaml flight -o out", 2,
       "flight was not expected", "is camera.yaml meant as --camera camera.yaml?"},
      {"latitude and longitude exchanged", "reconstruct flight --positions exchanged.csv -o out", 1,
       "exchanged.csv:2: no positions in this file", "are the two exchanged?"},
      {"a video as file of positions", "reconstruct flight --positions broken.mp4 -o out", 1,
       "broken.mp4: the video has no subtitles with positions", "expected DJI telemetry"},
      {"all products, and some", "reconstruct flight --products dsm,all -o out", 2, "--products",
       "stands alone"},
      // The other tools.
      {"all images of a flight for a depth map", "depth twelve --camera camera.yaml -o out", 2,
       "twelve: wrong number of images", "mono3d-reconstruct"},
      {"a calibration into a folder that is not there", "calibrate flight -o none/new.yaml", 1,
       "none/new.yaml", "cannot create the file"},
      {"four images for a depth map",
       "depth flight/0.jpg flight/1.jpg flight/2.jpg flight/3.jpg --camera camera.yaml -o out", 2,
       "wrong number of images", "expected 3, 5, 7 or 9"},
      {"a depth map without a calibration", "depth flight -o out", 2, "--camera", "--help"},
      {"images of two sizes for a depth map",
       "depth two_sizes --camera camera.yaml --poses poses.txt -o out", 1,
       "3.png: image has another size than the calibration", "--resize"},
      {"a cut image for a depth map",
       "depth flight/1.jpg cut/0.jpg flight/2.jpg --camera camera.yaml -o out", 1,
       "cut/0.jpg: the image is truncated", "copy it again"},
      {"a damaged image for a depth map",
       "depth flight/1.jpg damaged/0.jpg flight/2.jpg --camera camera.yaml -o out", 1,
       "damaged/0.jpg: the image is damaged", "copy it again"},
      {"poses of fewer images", "depth flight --camera camera.yaml --poses poses.txt -o out", 1,
       "poses.txt: wrong number of poses", "expected 5, one for each image"},
      {"a pose that is none", "depth flight --camera camera.yaml --poses bent.txt -o out", 1,
       "bent.txt:2", "unit length"},
      {"a board without its size", "calibrate flight -o new.yaml --board chess", 2, "--board",
       "COLUMNSxROWS"},
      {"two kinds of board", "calibrate flight -o new.yaml --board 9x6 --charuco 7x5", 2,
       "--charuco", "--board"},
      {"too few images for a calibration", "calibrate one -o new.yaml", 1, "one: too few images",
       "3 or more"},
      {"nothing to evaluate", "evaluate", 2, "subcommand", "--help"},
      {"a trajectory that is not there", "evaluate trajectory none.txt poses.txt", 1, "none.txt",
       "no such file"},
      {"a trajectory with a word in it", "evaluate trajectory words.txt poses.txt", 1,
       "words.txt:2", "zero"},
      {"a text as trajectory", "evaluate trajectory notes.txt poses.txt", 1, "notes.txt", "TUM"},
      {"trajectories of other times", "evaluate trajectory poses.txt later.txt", 1, "poses.txt",
       "time"},
      {"a folder that is no run", "evaluate run flight flight", 1, "flight: not the output",
       "trajectory.txt"},
      {"run and truth exchanged", "evaluate run measured run", 1, "measured: not the output",
       "behind the run"},
      {"a sequence without truth", "evaluate run run flight", 1, "flight", "groundtruth.txt"},
      {"a cut point cloud", "evaluate cloud cut.ply cut.ply", 1, "cut.ply", "ends too early"},
      {"an alignment that is not there", "evaluate trajectory poses.txt poses.txt --align best", 2,
       "--align", "sim3"},
      {"a model that is not there", "render none.ply --overview -o out.png", 1, "none.ply",
       "no such file"},
      {"a run in place of its model", "render finished --overview -o out.png", 1, "finished",
       "name the model.ply in it"},
      {"a picture without a pose", "render cut.ply -o out.png", 2, "--overview", "--pose"},
      {"a scene that is not there", "simulate -o out --scene.kind moon", 2,
       "--scene.kind: expected one of", "town"},
      {"a view of no run", "view flight", 1, "flight: there is no run",
       "the output folder of mono3d-reconstruct"},
      {"a view of a model", "view finished/model.ply", 1, "finished/model.ply: there is no run",
       "name its folder"},
  };
  return all;
}

}  // namespace mono3d
