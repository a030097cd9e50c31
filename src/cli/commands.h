// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/record.h"
#include "client/failure.h"
#include "client/program.h"
#include "client/request.h"

// The sub-commands that are clients of a robot. Each throws Failure.

namespace corbot::cli {

struct ClientOptions {
  std::string robot;    ///< see find_robot()
  double timeout_s{5};  ///< of a single call
};

/// Executes the request. Ctrl-C stops the arm and throws Failure with kStopped.
void run_request(const ClientOptions& options, const client::Request& request);
/// Prints the robot's plan for this motion; nothing moves.
struct PlanOptions {
  bool dry_run{false};
  std::string profile;  ///< profile of the robot's arm, for the picture
  std::string plot;     ///< file of the picture; empty: none
};
void show_plan(const ClientOptions& options, const client::Request& request, const PlanOptions& plan);
struct RunOptions {
  std::string file;     ///< "-": standard input
  bool dry_run{false};  ///< only checks and prints
  std::string profile;  ///< profile of the arm whose reach a dry run checks; empty: no check
  std::string plot;     ///< file of the picture of the motions in a dry run; empty: none
};
/// Runs a program.
void run_file(const ClientOptions& options, const RunOptions& run);

enum class View { kStatus, kAlarms, kDiagnostics };
/// `svg`: with kStatus, a file for a picture of the arm as it stands and its reach; empty: none. Only the
/// robot's machine can draw it.
void show(const ClientOptions& options, View view, bool as_json, const std::string& svg = "");
/// `pose`: X Y Z, or X Y Z QW QX QY QZ.
void show_solutions(const ClientOptions& options, const std::vector<double>& pose, bool as_json);
void run_watch(const ClientOptions& options, double interval_s, int count);
/// Fills in the robot's name and its number of joints, then records.
void run_record(const ClientOptions& options, RecordOptions record_options);

}  // namespace corbot::cli
