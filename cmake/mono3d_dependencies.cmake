# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Every outside library, named once. cmake/install-dependencies.sh installs them on Debian 12.

# A program loads those of them that it uses.
add_link_options(LINKER:--as-needed)

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4.5 REQUIRED COMPONENTS core imgproc imgcodecs videoio features2d calib3d
             aruco)
find_package(Ceres 2.1 REQUIRED)
find_package(Vulkan REQUIRED COMPONENTS glslangValidator)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(yaml-cpp 0.7 REQUIRED)
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(spirv-cross REQUIRED IMPORTED_TARGET spirv-cross-c-shared)
# Not through its CMake package: that of Debian 12 speaks of a file it does not install.
pkg_check_modules(openexr REQUIRED IMPORTED_TARGET OpenEXR>=3.1)
# Images whose decoders OpenCV would let print; libjpeg is that of libjpeg-turbo.
pkg_check_modules(jpeg REQUIRED IMPORTED_TARGET libjpeg)
pkg_check_modules(png REQUIRED IMPORTED_TARGET libpng>=1.6)
# Metadata of photos: EXIF, and XMP, which is XML.
pkg_check_modules(exif REQUIRED IMPORTED_TARGET libexif)
pkg_check_modules(heif REQUIRED IMPORTED_TARGET libheif>=1.11)
pkg_check_modules(expat REQUIRED IMPORTED_TARGET expat)
# OpenCV's videoio reads videos by the same libraries, but lets nothing be said of the protocols of a
# stream, nor of the bit rate of a video that it writes.
pkg_check_modules(ffmpeg REQUIRED IMPORTED_TARGET
  libavcodec>=59 libavformat>=59 libavutil>=57 libswscale>=6)
# Coordinate systems, and the raster files of a survey. Without them everything else works, and
# mono3d-export says what is missing.
pkg_check_modules(proj IMPORTED_TARGET proj>=8)
pkg_check_modules(gdal IMPORTED_TARGET gdal>=3.1)
# Meshes for other programs: fewer triangles, glTF files.
find_package(meshoptimizer 0.18 REQUIRED)
pkg_check_modules(tinygltf REQUIRED IMPORTED_TARGET tinygltf>=2.5)
if(MONO3D_BUILD_EVALUATION)
  # FLANN's headers call LZ4, which its CMake package does not name.
  find_package(flann 1.9 REQUIRED)
  pkg_check_modules(lz4 REQUIRED IMPORTED_TARGET liblz4)
endif()
if(MONO3D_BUILD_SYNTHETIC)
  find_package(embree 3 REQUIRED)
endif()
if(MONO3D_BUILD_TOOLS)
  find_package(CLI11 2.1 REQUIRED)
  find_package(spdlog 1.10 REQUIRED)
  # The server of the view.
  pkg_check_modules(httplib REQUIRED IMPORTED_TARGET cpp-httplib>=0.11)
endif()
if(MONO3D_BUILD_TESTS)
  find_package(GTest 1.12 REQUIRED)
endif()
