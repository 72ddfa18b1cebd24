// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/photo_prior.h"

#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <vector>

#include "io/image_file.h"
#include "io/image_metadata.h"
#include "io/photo_file.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/camera_metadata.h"

namespace mono3d {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

// A Phantom 4 RTK, by its maker; a picture of 5472 x 3648.
constexpr const char* kDewarpData =
    "drone-dji:DewarpData=\"2018-09-04;3678.870000000000,3671.840000000000,10.100000000000,"
    "27.290000000000,-0.268652000000,0.114663000000,0.000015268800,-0.000046070700,"
    "-0.035026100000\" ";
constexpr const char* kDesign =
    "drone-dji:CalibratedFocalLength=\"3666.666504\" "
    "drone-dji:CalibratedOpticalCenterX=\"2736.000000\" "
    "drone-dji:CalibratedOpticalCenterY=\"1824.000000\" ";
constexpr double kTenth_px = 0.1;

class PhotoPrior : public TemporaryFolderTest {
 protected:
  PhotoPrior() {
    SetLogSink([this](LogLevel level, std::string_view message) {
      if (level == LogLevel::kWarning) warnings_.emplace_back(message);
    });
  }
  ~PhotoPrior() override { SetLogSink({}); }

  CameraPrior Read(const std::string& bytes) const {
    return ReadPhotoPrior(WriteText("photo.jpg", bytes));
  }
  // Of a picture of 1368 x 912: a quarter of a Phantom 4 RTK's.
  CameraPrior ReadQuarter(const std::string& xmp, const std::string& exif = {}) const {
    return Read(JpegPhoto(1368, 912, exif, xmp));
  }

  std::vector<std::string> warnings_;
};

ExifWriter FourThirdsDrone() {
  return ExifWriter().Camera("DJI", "FC330").FocalLength(3.61).FocalLength35(20);
}

TEST_F(PhotoPrior, OfDewarpDataIsTheCalibrationOfTheMaker) {
  const std::string exif = ExifWriter().Camera("DJI", "FC6310R").Size(5472, 3648).Block();
  const CameraPrior prior = ReadQuarter(
      DjiPacket(std::string(kDesign) + kDewarpData + "drone-dji:DewarpFlag=\"0\""), exif);
  EXPECT_EQ(prior.source, CameraPriorSource::kXmp);
  EXPECT_EQ(prior.camera.width, 1368);
  EXPECT_NEAR(prior.camera.fx, 3678.87 / 4, 1e-9);
  EXPECT_NEAR(prior.camera.fy, 3671.84 / 4, 1e-9);
  // Offsets from the middle, which is between two pixels.
  EXPECT_NEAR(prior.camera.cx, 683.5 + 10.1 / 4, 1e-9);
  EXPECT_NEAR(prior.camera.cy, 455.5 + 27.29 / 4, 1e-9);
  EXPECT_EQ(prior.camera.distortion,
            (std::array{-0.268652, 0.114663, 1.52688e-5, -4.60707e-5, -0.0350261}));
  EXPECT_EQ(prior.focal_sigma, 0.01);
  EXPECT_LT(prior.principal_point_sigma_px, 3);
  EXPECT_EQ(prior.description, "DJI FC6310R, calibrated by its maker on 2018-09-04");
  EXPECT_THAT(warnings_, IsEmpty());
}

// XMP writes properties as attributes or as elements, under any prefix.
TEST_F(PhotoPrior, OfXmpInAnotherSpellingIsTheSame) {
  const std::string element =
      "<x:xmpmeta xmlns:x='adobe:ns:meta/'><rdf:RDF "
      "xmlns:rdf='http://www.w3.org/1999/02/22-rdf-syntax-ns#'><rdf:Description rdf:about='' "
      "xmlns:d='http://www.dji.com/drone-dji/1.0/'><d:CalibratedFocalLength> +900.5 "
      "</d:CalibratedFocalLength><other xmlns='x'>2</other></rdf:Description></rdf:RDF>"
      "</x:xmpmeta>";
  EXPECT_EQ(ReadQuarter(element).camera.fx, 900.5);
  EXPECT_EQ(ReadQuarter(element + std::string(100, '\0')).camera.fx, 900.5) << "filled with zeros";
}

TEST_F(PhotoPrior, OfAPictureWithoutDistortionHasNone) {
  const CameraPrior prior =
      ReadQuarter(DjiPacket(std::string(kDesign) + kDewarpData + "drone-dji:DewarpFlag=\"1\""));
  EXPECT_EQ(prior.source, CameraPriorSource::kXmp);
  EXPECT_NEAR(prior.camera.fx, 3666.666504 / 4, 1e-9);
  EXPECT_EQ(prior.camera.fy, prior.camera.fx);
  EXPECT_FALSE(prior.camera.HasDistortion());
  EXPECT_LT(prior.distortion_sigma[0], DefaultCameraPrior(1368, 912).distortion_sigma[0] / 5);
}

TEST_F(PhotoPrior, OfADesignedFocalLengthHasTheLensOfAnUnknownCamera) {
  const CameraPrior prior = ReadQuarter(DjiPacket(kDesign));
  EXPECT_EQ(prior.source, CameraPriorSource::kXmp);
  EXPECT_NEAR(prior.camera.fx, 3666.666504 / 4, 1e-9);
  EXPECT_EQ(prior.camera.cx, 683.5);
  EXPECT_EQ(prior.focal_sigma, 0.01);
  EXPECT_EQ(prior.distortion_sigma, DefaultCameraPrior(1368, 912).distortion_sigma);
}

// The size that XMP is of: by EXIF, or by the designed centre, where the program that resized the
// picture told EXIF of it.
TEST_F(PhotoPrior, OfAResizedPictureIsResized) {
  for (const std::string& exif : {ExifWriter().Size(5472, 3648).Block(),
                                  ExifWriter().Size(1368, 912).Block(), std::string()}) {
    EXPECT_NEAR(ReadQuarter(DjiPacket(kDesign), exif).camera.fx, 3666.666504 / 4, 1e-9);
  }
}

TEST_F(PhotoPrior, OfXmpOfAnotherSizeIsThatOfExif) {
  // Nothing tells that DewarpData are of a picture four times as large, but 24 mm do.
  const std::string exif = ExifWriter().FocalLength(8.8).FocalLength35(24).Size(1368, 912).Block();
  const CameraPrior prior = ReadQuarter(DjiPacket(kDewarpData), exif);
  EXPECT_EQ(prior.source, CameraPriorSource::kExif);
  EXPECT_NEAR(prior.camera.fx, 24. / 36 * 1368, kTenth_px);
  EXPECT_THAT(warnings_, Contains(HasSubstr("3679 px of XMP is not used")));
}

TEST_F(PhotoPrior, OfATurnedPictureHasNoDirection) {
  const std::string exif = ExifWriter().Size(5472, 3648).Block();
  const CameraPrior prior = Read(JpegPhoto(912, 1368, exif, DjiPacket(kDewarpData)));
  EXPECT_EQ(prior.camera.width, 912);
  EXPECT_NEAR(prior.camera.fy, 3678.87 / 4, 1e-9);
  EXPECT_EQ(prior.camera.cx, 455.5);
  EXPECT_EQ(prior.camera.cy, 683.5);
  EXPECT_GT(prior.principal_point_sigma_px, 10);
  EXPECT_EQ(prior.camera.distortion[0], -0.268652);
  EXPECT_EQ(prior.camera.distortion[2], 0);
}

TEST_F(PhotoPrior, OfACroppedPictureKeepsItsFocalLength) {
  const std::string exif = FourThirdsDrone().Size(4000, 3000).Block();
  const double focal_px = Read(JpegPhoto(4000, 3000, exif)).camera.fx;
  const CameraPrior wide = Read(JpegPhoto(4000, 2250, exif));
  EXPECT_NEAR(wide.camera.fx, focal_px, 1e-9);
  EXPECT_EQ(wide.camera.cy, 1124.5);
  EXPECT_GT(wide.principal_point_sigma_px, 200) << "of 750 px that were cropped somewhere";
  const CameraPrior small = Read(JpegPhoto(1000, 500, exif));
  EXPECT_NEAR(small.camera.fx, focal_px / 4, 1e-9);
  EXPECT_GT(small.focal_sigma, 0.1);
}

// Pixels are read as they are stored, whatever way up the camera was.
TEST_F(PhotoPrior, DoesNotDependOnTheOrientation) {
  const auto photo = [](int orientation) {
    ExifWriter exif = FourThirdsDrone();
    exif.Size(400, 300).Short(ExifWriter::Directory::kImage, 0x0112,
                              static_cast<std::uint32_t>(orientation));
    return JpegPhoto(400, 300, exif.Block(), DjiPacket(""));
  };
  const CameraPrior turned = Read(photo(6));
  EXPECT_EQ(turned.camera, Read(photo(1)).camera);
  const cv::Mat image = ReadImage(folder_ / "photo.jpg");
  EXPECT_EQ(turned.camera.width, image.cols);
  EXPECT_EQ(turned.camera.height, image.rows);
}

// 24 mm before a sensor of 36 mm: 2/3 of the width.
TEST_F(PhotoPrior, OfTheSensorIsFocalLengthOverWidth) {
  const auto photo = [](double pixels_per_mm, int unit, int width) {
    const double per_unit = unit == 3 ? 10 : 25.4;
    return JpegPhoto(width, width * 2 / 3,
                     ExifWriter(ExifWriter::ByteOrder::kBigEndian)
                         .Camera("Canon", "Canon EOS 5D")
                         .FocalLength(24)
                         .FocalPlane(per_unit * pixels_per_mm, unit)
                         .Size(1440, 960)
                         .Block());
  };
  const CameraPrior prior = Read(photo(40, 2, 1440));
  EXPECT_EQ(prior.source, CameraPriorSource::kExif);
  EXPECT_NEAR(prior.camera.fx, 960, kTenth_px);
  EXPECT_EQ(prior.focal_sigma, 0.04);
  EXPECT_EQ(prior.description, "Canon EOS 5D, 24.0 mm, pixels of 25.00 um");
  EXPECT_NEAR(Read(photo(40, 3, 1440)).camera.fx, 960, kTenth_px) << "per cm";
  EXPECT_NEAR(Read(photo(40, 2, 720)).camera.fx, 480, kTenth_px) << "resized";
  EXPECT_THAT(warnings_, IsEmpty());
  // Told of a picture of 1440 pixels that was resized from another size: a sensor of 7 mm with
  // pixels of 5 um is that of no camera.
  EXPECT_EQ(Read(photo(200, 2, 1440)).source, CameraPriorSource::kDefault);
  EXPECT_THAT(warnings_, Contains(HasSubstr("EXIF has an absurd focal length")));
}

TEST_F(PhotoPrior, OfASensorThatContradictsTheAngleOfViewIsThatOfTheAngle) {
  const CameraPrior prior = Read(JpegPhoto(
      1440, 960, ExifWriter().FocalLength(24).FocalPlane(80 * 25.4, 2).FocalLength35(24).Block()));
  EXPECT_NEAR(prior.camera.fx, 960, kTenth_px);
  EXPECT_THAT(prior.description, HasSubstr("24 mm (35 mm equivalent)"));
}

TEST_F(PhotoPrior, OfAFocalLengthIn35mmFilmIsThatOfTheDiagonal) {
  const auto focal_px = [&](ExifWriter exif, int width, int height) {
    return Read(JpegPhoto(width, height, exif.Block())).camera.fx;
  };
  const ExifWriter full_frame = ExifWriter().FocalLength(24).FocalLength35(24);
  EXPECT_NEAR(focal_px(full_frame, 900, 600), 600, kTenth_px);
  EXPECT_NEAR(focal_px(full_frame, 600, 900), 600, kTenth_px) << "upright";
  const double of_four_thirds = 20 / 43.27 * 500;  // the diagonal of 400 x 300
  EXPECT_NEAR(focal_px(FourThirdsDrone(), 400, 300), of_four_thirds, kTenth_px);
  // A wide picture has the whole width of the sensor: of 4:3 behind a lens of 3.6 mm.
  EXPECT_NEAR(focal_px(FourThirdsDrone(), 400, 225), of_four_thirds, kTenth_px);
  EXPECT_NEAR(focal_px(full_frame, 960, 540), 640, kTenth_px) << "of a sensor of 3:2";
}

// FC300S: a calibration says 937 px.
TEST_F(PhotoPrior, CoversWhatACameraMayMean) {
  const CameraPrior prior = Read(JpegPhoto(1600, 900, FourThirdsDrone().Block()));
  const double sigma_px = prior.focal_sigma * prior.camera.fx;
  EXPECT_NEAR(prior.camera.fx, 937, 0.5 * sigma_px);
  EXPECT_NEAR(prior.camera.fx, 20. / 36 * 1600, 2 * sigma_px) << "36 mm for the width";
  const double diagonal_px = std::hypot(1600, 900);
  EXPECT_NEAR(prior.camera.fx, 20 / 43.27 * diagonal_px, 2 * sigma_px) << "by the picture";
  // A square picture: of the whole height of the sensor, or by its own diagonal.
  const RelativeFocal square = FocalOf35mm(20, 3.61, 300, 300);
  EXPECT_NEAR(square.value, 20 / 43.27 * std::sqrt(2), 1.1 * square.sigma * square.value);
  EXPECT_NEAR(square.value, 20 / 43.27 * 5 / 3, 1.1 * square.sigma * square.value);
  EXPECT_GT(FocalOf35mm(10, 0, 400, 300).sigma, FocalOf35mm(100, 0, 400, 300).sigma) << "rounding";
}

TEST_F(PhotoPrior, TakesTheDigitalZoomIntoAccount) {
  constexpr int kDigitalZoomRatio = 0xA404;
  const auto zoomed = [](std::uint32_t ratio) {
    return ExifWriter()
        .FocalLength(24)
        .FocalPlane(254 * 40, 3)
        .Rational(ExifWriter::Directory::kExif, kDigitalZoomRatio, ratio, ratio == 0 ? 0 : 1);
  };
  const double focal_px = Read(JpegPhoto(3600, 2400, zoomed(0).Block())).camera.fx;
  EXPECT_NEAR(Read(JpegPhoto(3600, 2400, zoomed(2).Block())).camera.fx, 2 * focal_px, kTenth_px);
}

TEST_F(PhotoPrior, OfAbsurdValuesIsTheDefault) {
  using enum ExifWriter::Directory;
  const std::string blocks[] = {
      ExifWriter().FocalLength35(0).FocalLength(0).Block(),
      ExifWriter().FocalLength35(60000).Block(),
      ExifWriter().FocalLength35(1).Block(),
      ExifWriter().Rational(kExif, 0x920A, 24, 0).FocalPlane(1000, 2).Block(),
      ExifWriter().FocalLength(24).FocalPlane(0, 2).Block(),
      ExifWriter().FocalLength(24).FocalPlane(4e6, 2).Block(),
      ExifWriter().FocalLength(24).FocalPlane(1000, 77).Block(),
      ExifWriter().Ascii(kExif, 0xA405, "24").Block(),
      ExifWriter().FocalLength(3.6).Camera("DJI", "FC330").Block()};
  for (const std::string& exif : blocks) {
    EXPECT_EQ(Read(JpegPhoto(90, 60, exif)).source, CameraPriorSource::kDefault);
  }
  warnings_.clear();
  const std::string values[] = {"drone-dji:CalibratedFocalLength=\"nan\"",
                                "drone-dji:CalibratedFocalLength=\"1e999\"",
                                "drone-dji:CalibratedFocalLength=\"-90\"",
                                "drone-dji:CalibratedFocalLength=\"1000000\"",
                                "drone-dji:DewarpData=\"2018-09-04;80,80,0,0,-0.2,0,0,0\"",
                                "drone-dji:DewarpData=\"2018-09-04;80,160,0,0,-0.2,0,0,0,0\"",
                                "drone-dji:DewarpData=\"2018-09-04;80,80,0,0,nan,0,0,0,0\"",
                                "drone-dji:DewarpData=\"2018-09-04;80,80,0,0,-27,0,0,0,0\"",
                                "drone-dji:DewarpData=\"2018-09-04;80,80,900,0,0,0,0,0,0\"",
                                "drone-dji:DewarpData=\"80 80 0 0 0 0 0 0 0\"",
                                "drone-dji:DewarpData=\";\""};
  for (const std::string& value : values) {
    EXPECT_EQ(Read(JpegPhoto(90, 60, {}, DjiPacket(value))).source, CameraPriorSource::kDefault)
        << value;
    EXPECT_THAT(warnings_, Contains(HasSubstr("photo.jpg: XMP has absurd values"))) << value;
    warnings_.clear();
  }
  const CameraPrior tiny =
      Read(JpegPhoto(900, 600, {}, DjiPacket("drone-dji:CalibratedFocalLength=\"2\"")));
  EXPECT_EQ(tiny.source, CameraPriorSource::kDefault);
}

TEST_F(PhotoPrior, PassesOverSizesOfNothing) {
  const CameraPrior expected = Read(JpegPhoto(400, 300, FourThirdsDrone().Block()));
  for (const auto& [width, height] : {std::pair(0, 0), std::pair(1, 1), std::pair(-1, 300)}) {
    const CameraPrior prior =
        Read(JpegPhoto(400, 300, FourThirdsDrone().Size(width, height).Block()));
    EXPECT_EQ(prior.camera, expected.camera) << width;
  }
}

TEST_F(PhotoPrior, OfDamagedXmpIsThatOfExif) {
  const std::string exif = ExifWriter().FocalLength(24).FocalLength35(24).Block();
  const std::string packet = DjiPacket(kDesign);
  const std::string whole = packet.substr(0, packet.rfind("</x:xmpmeta>"));
  const std::string damaged[] = {
      "",
      "no XML",
      "<",
      whole,
      whole + "</x:other>",
      packet.substr(0, packet.find("3666")),
      "<a " + std::string(kDesign) + "/>",  // prefix without a namespace
      "<!DOCTYPE a [<!ENTITY b \"1\">]>" + packet.substr(packet.find("<x:"))};
  for (const std::string& xmp : damaged) {
    warnings_.clear();
    EXPECT_EQ(ReadQuarter(xmp, exif).source, CameraPriorSource::kExif) << xmp;
    EXPECT_EQ(warnings_.size(), xmp.empty() ? 0U : 1U) << xmp;
  }
}

// Up to three bytes changed, and the end cut off.
std::string Damage(std::string bytes, std::uint32_t& random) {
  const auto next = [&random](std::size_t end) {
    random = random * 1664525U + 1013904223U;
    return (random >> 8U) % end;
  };
  for (std::size_t i = next(4); i > 0; --i) {
    bytes[next(bytes.size())] = static_cast<char>(next(256));
  }
  if (next(3) == 0) bytes.resize(next(bytes.size()));
  return bytes;
}

TEST_F(PhotoPrior, OfDamagedMetadataIsValid) {
  const std::string exif = FourThirdsDrone().Serial("0123456789").Size(5472, 3648).Block();
  std::uint32_t random = 1;
  int num_used = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto path = WriteText("photo.jpg", JpegPhoto(136, 91, Damage(exif, random),
                                                       Damage(DjiPacket(kDewarpData), random)));
    const CameraPrior prior = ReadPhotoPrior(path);
    EXPECT_NO_THROW(Validate(prior, "damaged"));
    EXPECT_EQ(prior.camera.width, 136);
    EXPECT_GE(prior.camera.fx, 0.1 * 136);
    if (prior.source != CameraPriorSource::kDefault) ++num_used;
  }
  EXPECT_GT(num_used, 300) << "the damage leaves nothing to read";
}

TEST_F(PhotoPrior, OfAFileCutInItsMetadataIsReadToThere) {
  const std::string photo = JpegPhoto(136, 91, FourThirdsDrone().Block(), DjiPacket(kDewarpData));
  for (std::size_t size = 2; size < photo.size(); size += 7) {
    const ImageMetadata metadata = ReadImageMetadata(WriteText("cut.jpg", photo.substr(0, size)));
    EXPECT_LE(metadata.exif.size() + metadata.xmp.size(), size);
    EXPECT_TRUE(metadata.width == 0 || metadata.width == 136);
  }
}

TEST_F(PhotoPrior, OfAnEmptyExifBlockIsTheDefault) {
  using namespace std::string_literals;
  for (const std::string& exif :
       {"Exif\0\0"s, "Exif\0\0II*\0"s, "Exif\0\0MM\0*\xFF\xFF\xFF\xFF"s}) {
    warnings_.clear();
    EXPECT_EQ(Read(JpegPhoto(40, 30, exif)).source, CameraPriorSource::kDefault);
    EXPECT_THAT(warnings_, Contains(HasSubstr("photo.jpg: EXIF is damaged")));
  }
}

TEST_F(PhotoPrior, IsReadFromTiffFiles) {
  using enum ExifWriter::Directory;
  for (const auto order :
       {ExifWriter::ByteOrder::kLittleEndian, ExifWriter::ByteOrder::kBigEndian}) {
    const std::string xmp = DjiPacket(kDesign);
    ExifWriter tiff(order);
    tiff.Long(kImage, 0x0100, 1368).Long(kImage, 0x0101, 912).Camera("DJI", "M3M");
    tiff.FocalLength(8.8).FocalLength35(24);
    const auto plain = WriteText("plain.tif", tiff.Tiff());
    EXPECT_EQ(ReadPhotoPrior(plain).source, CameraPriorSource::kExif);
    const auto dji = WriteText("dji.tif", tiff.Bytes(kImage, 0x02BC, xmp).Tiff());
    const CameraPrior prior = ReadPhotoPrior(dji);
    EXPECT_EQ(prior.source, CameraPriorSource::kXmp);
    EXPECT_EQ(prior.camera.width, 1368);
    EXPECT_NEAR(prior.camera.fx, 3666.666504 / 4, 1e-9);
  }
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(PhotoPrior, OfWhatIsNoImageIsAnError) {
  EXPECT_THROW(ReadPhotoPrior(folder_ / "none.jpg"), Error);
  EXPECT_THROW(ReadPhotoPrior(folder_), Error);
  EXPECT_THROW(Read("no image"), Error);
  EXPECT_THROW(Read(""), Error);
  EXPECT_THROW(Read("\xFF\xD8\xFF\xE1"), Error);
}

}  // namespace
}  // namespace mono3d
