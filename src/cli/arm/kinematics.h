// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

struct KinematicsOptions {
  std::string profile{};
  std::string pose{};    ///< "x,y,z" or "x,y,z,qw,qx,qy,qz"; empty: the pose of `joints`
  std::string joints{};  ///< one number for each joint, degrees or m; empty: all 0
  bool json{false};
  std::string svg{};      ///< file for the picture; empty: none
  bool thumbnail{false};  ///< the picture is small, for a table
};

/// Runs `corbot kinematics`. Throws Failure.
void kinematics(const KinematicsOptions& options);

struct ExportOptions {
  std::string profile{};
  std::string output{};  ///< file; empty: standard output
};

/// Runs `corbot export --urdf`. Throws Failure.
void export_urdf(const ExportOptions& options);

}  // namespace corbot::cli
