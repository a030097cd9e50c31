// SPDX-License-Identifier: Apache-2.0
// Measures the time that the servant adds to the ORB: ArtiCoord through corbot-servant against the same
// answer from a bare omniORB object. Calls alternate between the two in one process, so that a busy machine
// hits both alike.
#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <arm.hh>
#include <chrono>
#include <cstdlib>
#include <echo.hh>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "support/paths.h"

namespace {

using Clock = std::chrono::steady_clock;

/// A free TCP port of the loopback interface.
int free_port() {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  if (::bind(fd, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("no free port");
  }
  ::close(fd);
  return ntohs(address.sin_port);
}

/// A child whose first output line that begins with 'ready' has been seen; it is ended with this object.
class Child {
 public:
  explicit Child(std::vector<std::string> command) {
    int in[2];
    int out[2];
    if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    pid_ = ::fork();
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::dup2(in[0], STDIN_FILENO);
      ::dup2(out[1], STDOUT_FILENO);
      std::vector<char*> argv;
      for (auto& word : command) argv.push_back(word.data());
      argv.push_back(nullptr);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    ::close(in[0]);
    ::close(out[1]);
    input_ = in[1];
    output_ = out[0];
    std::string line;
    for (char c = 0; line.rfind("ready", 0) != 0 || c != '\n';) {
      if (c == '\n') line.clear();
      if (::read(output_, &c, 1) != 1) throw std::runtime_error(command[0] + " did not start");
      line.push_back(c);
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    ::kill(pid_, SIGTERM);
    ::close(input_);
    ::waitpid(pid_, nullptr, 0);
    ::close(output_);
  }

 private:
  pid_t pid_ = -1;
  int input_ = -1;
  int output_ = -1;
};

struct Series {
  std::vector<double> us;
  double percentile(double p) {
    std::sort(us.begin(), us.end());
    return us[std::min(us.size() - 1, static_cast<std::size_t>(p * static_cast<double>(us.size())))];
  }
};

template <class Call>
void timed(Series& series, Call&& call) {
  const auto begin = Clock::now();
  call();
  series.us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
}

void report(const char* what, Series& ours, Series& bare) {
  fmt::print(
      "{:<32} servant p50 {:7.1f} p99 {:7.1f} us   bare p50 {:7.1f} p99 {:7.1f} us   ratio p50 {:.3f}\n",
      what, ours.percentile(0.5), ours.percentile(0.99), bare.percentile(0.5), bare.percentile(0.99),
      ours.percentile(0.5) / bare.percentile(0.5));
}

}  // namespace

int main(int argc, char** argv) try {
  const int calls = argc > 1 ? std::atoi(argv[1]) : 20000;
  const std::string name = fmt::format("bench{}", ::getpid());
  const int port = free_port();
  const int echo_port = free_port();
  const std::string bin = CORBOT_BIN_DIR;
  Child rt({bin + "/corbot-rt", CORBOT_TIMED_PROFILE, "--name", name});
  Child servant({bin + "/corbot-servant", CORBOT_TIMED_PROFILE, "--name", name, "--endpoint",
                 fmt::format("127.0.0.1:{}", port)});
  Child echo_server({std::string(CORBOT_BINARY_DIR "/bench") + "/bench_echo_server", "-ORBendPoint",
                     fmt::format("giop:tcp:127.0.0.1:{}", echo_port)});

  int orb_argc = 1;
  CORBA::ORB_var orb = CORBA::ORB_init(orb_argc, argv);
  CORBA::Object_var object =
      orb->string_to_object(fmt::format("corbaloc::127.0.0.1:{}/{}", port, name).c_str());
  Corbot::Arm_var arm = Corbot::Arm::_narrow(object);
  object = orb->string_to_object(fmt::format("corbaloc::127.0.0.1:{}/echo", echo_port).c_str());
  CorbotBench::Echo_var echo = CorbotBench::Echo::_narrow(object);

  Series read_ours;
  Series read_bare;
  for (int i = 0; i < calls + 1000; ++i) {
    if (i == 1000) read_ours.us.clear(), read_bare.us.clear();  // warmed up
    timed(read_ours, [&] { Corbot::JointCoord_var joints = arm->ArtiCoord(); });
    timed(read_bare, [&] { CorbotBench::Values_var values = echo->Joints(); });
  }
  Series move_ours;
  Series move_bare;
  Corbot::CartesianCoord here = arm->CartCoord();
  arm->Move(here.x, here.y, here.z, 0.0, 0.0);
  here = arm->CartCoord();
  for (int i = 0; i < calls / 20; ++i) {
    timed(move_ours, [&] { arm->Move(here.x, here.y, here.z, 0.0, 0.0); });
    timed(move_bare, [&] { echo->Motion(here.x, here.y, here.z, 0.0, 0.0); });
  }
  fmt::print("{} reads each, alternating, TCP over loopback\n", calls);
  report("ArtiCoord / echo attribute", read_ours, read_bare);
  report("zero-length Move / echo", move_ours, move_bare);
  orb->destroy();
  return 0;
} catch (const CORBA::Exception& error) {
  fmt::print(stderr, "bench_servant: CORBA {}\n", error._name());
  return 1;
} catch (const std::exception& error) {
  fmt::print(stderr, "bench_servant: {}\n", error.what());
  return 1;
}
