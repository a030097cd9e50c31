# SPDX-License-Identifier: Apache-2.0
# Finds OpenCV's core and imgproc without libopencv-dev, which has the CMake files and needs 160 more
# packages. Without OpenCV the cell is not built.
if(TARGET corbot::opencv)
  return()
endif()
find_path(OPENCV_INCLUDE opencv2/imgproc.hpp PATH_SUFFIXES opencv4)
find_library(OPENCV_CORE opencv_core)
find_library(OPENCV_IMGPROC opencv_imgproc)
if(OPENCV_INCLUDE AND OPENCV_CORE AND OPENCV_IMGPROC)
  add_library(corbot_opencv INTERFACE)
  add_library(corbot::opencv ALIAS corbot_opencv)
  target_include_directories(corbot_opencv SYSTEM INTERFACE ${OPENCV_INCLUDE})
  target_link_libraries(corbot_opencv INTERFACE ${OPENCV_IMGPROC} ${OPENCV_CORE})
endif()
