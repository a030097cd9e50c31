// SPDX-License-Identifier: Apache-2.0
#include "cell/scene/scene_program.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <functional>
#include <thread>
#include <utility>

#include "cell/program.h"
#include "cell/scene/picture_server.h"
#include "cell/scene/scene_loop.h"
#include "cell/scene/scene_recorder.h"
#include "notify/end_signals.h"
#include "rt/threads/thread_priority.h"
#include "sim/devices/control_input.h"
#include "sim/scene/picture.h"

namespace corbot::cell {
namespace {

constexpr std::chrono::milliseconds kLookWithin{1000};
/// The real-time priority of the servo controllers' emulation if the user may have one. The priority is below
/// every real-time task's. A line that is silent for half a second counts as a lost device.
constexpr int kPriority = 1;

/// A thread whose exception ends the program. join() rethrows the exception.
class Worker {
 public:
  explicit Worker(const std::function<void(const std::stop_token&)>& work)
      : thread_([this, work](const std::stop_token& stop) {
          try {
            work(stop);
          } catch (...) {
            failure_ = std::current_exception();
            (void)::kill(::getpid(), SIGTERM);
          }
        }) {}
  void join() {
    thread_.request_stop();
    thread_.join();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::exception_ptr failure_;
  std::jthread thread_;
};

void run(const CellConfig& cell, Scene::AfterTick after_tick) {
  Scene scene(cell, std::move(after_tick));
  scene.tick(sim::clock_ns());
  SceneRecorder recorder(scene_record_file(cell.state_directory), scene.cast());
  sim::ControlInput input;
  SceneLoop loop(
      scene, [&recorder](SceneSample sample) { recorder.add(std::move(sample)); }, &input);
  const CameraModel& lens = cell.scene->lens;
  sim::Picture picture({lens.size_px[0], lens.size_px[1], cell.scene->noise, cell.scene->seed,
                        [&lens](const Eigen::Vector3d& point) { return lens.project(point); }});
  PictureServer pictures(
      cell.picture_socket(), lens.size_px, [&loop] { return loop.look(kLookWithin); },
      [&picture](const SceneView& view) -> const std::vector<std::uint8_t>& {
        return picture.draw(view.pieces, view.arms);
      });
  Worker drawing([&](const std::stop_token& stop) { pictures.run(stop); });
  Worker recording([&](const std::stop_token& stop) { recorder.run(stop); });
  Worker looping([&](const std::stop_token& stop) {
    (void)rt::set_fifo_priority(kPriority);
    loop.run(stop);
  });
  run_until_signal("ready " + cell.state_directory.string());
  drawing.join();
  looping.join();
  recording.join();
  fmt::print("end {} overruns={}\n", scene.summary(), loop.overruns());
  std::fflush(stdout);
}

}  // namespace

int scene_main(int argc, char** argv,
               const std::function<Scene::AfterTick(const CellConfig&)>& make_after_tick) {
  return run_program(argc, argv,
                     {.name = "corbot-scene",
                      .about = "The simulated world of a cell: servo controllers, arms, pieces and pictures",
                      .run = [&](const CellConfig& cell) {
                        run(cell, make_after_tick ? make_after_tick(cell) : Scene::AfterTick());
                      }});
}

}  // namespace corbot::cell
