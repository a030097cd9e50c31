// SPDX-License-Identifier: Apache-2.0
// The camera and a source whose picture is wrong, cut or late: a typed error in time, and the next Look
// works.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <thread>

#include "cell/camera/camera_servant.h"
#include "cell/camera/picture_view.h"
#include "cell/picture_wire.h"
#include "corbot/units.h"
#include "sim/scene/picture.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

using cell::PictureHeader;
using Clock = std::chrono::steady_clock;

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// The scene's end of the wire: after each trigger it does what `reply` says with the connection.
class Peer {
 public:
  explicit Peer(const std::filesystem::path& path) : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.string().copy(address.sun_path, sizeof(address.sun_path) - 1);
    if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
        ::listen(fd_, 8) != 0)
      throw std::runtime_error(path.string() + ": cannot listen");
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) accept_one();
    });
  }
  ~Peer() {
    thread_.request_stop();
    ::shutdown(fd_, SHUT_RDWR);  // ends accept()
    thread_.join();
    ::close(fd_);
  }
  /// From the next connection on.
  void reply_with(std::function<void(int)> reply) {
    const std::lock_guard lock(mutex_);
    reply_ = std::move(reply);
  }

  static void send(int fd, const void* bytes, std::size_t size) {
    for (std::size_t done = 0; done < size;) {
      const ssize_t count = ::send(fd, static_cast<const char*>(bytes) + done, size - done, MSG_NOSIGNAL);
      if (count <= 0) return;  // the reader has closed
      done += static_cast<std::size_t>(count);
    }
  }
  /// Until the reader closes.
  static void be_silent(int fd) {
    char byte{};
    while (::recv(fd, &byte, 1, 0) > 0) continue;
  }

 private:
  void accept_one() {
    const int fd = ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC);
    if (fd < 0) return;
    char byte{};
    if (::recv(fd, &byte, 1, 0) == 1) next_reply()(fd);
    ::close(fd);
  }

  std::function<void(int)> next_reply() {
    const std::lock_guard lock(mutex_);
    return reply_;
  }

  int fd_;
  std::mutex mutex_;
  std::function<void(int)> reply_;
  std::jthread thread_;
};

class Source : public testing::Test {
 protected:
  void SetUp() override {
    std::string path = (std::filesystem::temp_directory_path() / "corbot-source-XXXXXX").string();
    directory_ = ::mkdtemp(path.data());
    cell::CellOverrides overrides;
    overrides.state_directory = directory_;
    cell_ = cell::load_cell(std::string(CORBOT_PROFILES) + "/cell/cell.toml", overrides);
    const cell::Kind& kind = cell_.kinds.front();
    sim::Picture picture(
        {.project = [&](const Eigen::Vector3d& point) { return cell_.camera.project(point); }});
    const sim::DrawnPiece piece{
        cell_.places.front().frame.position_m, kind.width_m, kind.height_m, kind.label_m, {30, 30, 200}};
    bytes_ = picture.draw(std::array{piece}, {});
    peer_.emplace(cell_.picture_socket());
    servant_.emplace(cell_);
  }
  void TearDown() override {
    servant_.reset();
    peer_.reset();
    std::filesystem::remove_all(directory_);
  }

  [[nodiscard]] PictureHeader header() const { return {.columns = 1280, .rows = 720, .exposure_s = now_s()}; }

  /// A picture of one piece whose header is changed in some way, and of which only so many bytes come.
  void reply(const std::function<void(PictureHeader&)>& change, std::size_t most_bytes = SIZE_MAX) {
    peer_->reply_with([this, change, most_bytes](int fd) {
      PictureHeader sent = header();
      change(sent);
      Peer::send(fd, &sent, std::min(most_bytes, sizeof(sent)));
      if (most_bytes > sizeof(sent))
        Peer::send(fd, bytes_.data(), std::min(most_bytes - sizeof(sent), bytes_.size()));
    });
  }

  /// The text of NotReady, which must come in the time-out.
  std::string refusal(double timeout_s) {
    const auto begin = Clock::now();
    std::string text;
    try {
      const Corbot::Frame_var frame = servant_->Look(timeout_s);
      ADD_FAILURE() << "a picture came";
    } catch (const Corbot::NotReady& error) {
      text = error.reason;
    }
    EXPECT_LT(std::chrono::duration<double>(Clock::now() - begin).count(), timeout_s + 2);  // a busy machine
    EXPECT_THAT(text, testing::StartsWith(cell_.picture_socket().string() + ": "));
    return text;
  }

  /// A Look that works: the frame's number.
  std::uint64_t good_number() {
    reply([](PictureHeader&) {});
    const double before_s = now_s();
    const Corbot::Frame_var frame = servant_->Look(10);
    EXPECT_GE(frame->time, before_s);
    EXPECT_EQ(frame->pieces.length(), 1U);
    if (frame->pieces.length() != 1) return 0;
    const Corbot::Sighting& seen = frame->pieces[0];
    EXPECT_STREQ(seen.kind, "red");
    const Eigen::Vector3d off = Eigen::Vector3d(seen.position.x, seen.position.y, seen.position.z) -
                                cell_.places.front().frame.position_m;
    EXPECT_LT(off.norm(), 0.0005);
    return frame->number;
  }

  std::string directory_;
  cell::CellConfig cell_;
  std::vector<std::uint8_t> bytes_;
  std::optional<Peer> peer_;
  std::optional<cell::CameraServant> servant_;
};

TEST_F(Source, ALieOrACutIsAnErrorAndTheNextLookWorks) {
  EXPECT_EQ(good_number(), 1U);
  struct Lie {
    std::function<void(PictureHeader&)> change;
    std::size_t bytes;
    const char* text;
  };
  const std::vector<Lie> lies{
      {[](PictureHeader& h) { h.magic = 0x20504d42; }, SIZE_MAX, "begins with 0x20504d42"},
      {[](PictureHeader& h) { h.columns = h.rows = 0xffffffff; }, SIZE_MAX, "4294967295 x 4294967295 pixels"},
      {[](PictureHeader& h) { h.rows = 719; }, SIZE_MAX, "1280 x 719 pixels"},
      {[](PictureHeader& h) { h.exposure_s -= 10; }, SIZE_MAX, "before it was asked for"},
      {[](PictureHeader& h) { h.exposure_s = std::nan(""); }, SIZE_MAX, "before it was asked for"},
      {[](PictureHeader&) {}, 0, "closed after 0 of 32 bytes"},
      {[](PictureHeader&) {}, 31, "closed after 31 of 32 bytes"},
      {[](PictureHeader&) {}, 32 + 1'000'000, "closed after 1000000 of 2764800 bytes"},
  };
  std::uint64_t number = 1;
  for (const Lie& lie : lies) {
    SCOPED_TRACE(lie.text);
    reply(lie.change, lie.bytes);
    EXPECT_THAT(refusal(10), testing::HasSubstr(lie.text));
    EXPECT_EQ(good_number(), ++number);
  }
}

TEST_F(Source, ASightingOfASquareHasItsYawInDegrees) {
  cell_.kinds.front().is_square = true;
  const cell::Kind& kind = cell_.kinds.front();
  const sim::DrawnPiece piece{.foot_m = cell_.places.front().frame.position_m,
                              .width_m = kind.width_m,
                              .height_m = kind.height_m,
                              .label_m = kind.label_m,
                              .label_bgr = {30, 30, 200},
                              .yaw_rad = to_radians(120),
                              .is_square = true};
  sim::Picture picture(
      {.project = [&](const Eigen::Vector3d& point) { return cell_.camera.project(point); }});
  bytes_ = picture.draw(std::array{piece}, {});
  servant_.emplace(cell_);
  reply([](PictureHeader&) {});
  const Corbot::Frame_var frame = servant_->Look(10);
  ASSERT_EQ(frame->pieces.length(), 1U);
  EXPECT_NEAR(frame->pieces[0].yaw, 30, 2);
}

TEST_F(Source, PictureIsTheLastThatWasExamined) {
  EXPECT_THROW(Corbot::Jpeg_var(servant_->Picture(false)), Corbot::NotReady);
  good_number();
  const auto bytes = [&](bool marked) {
    const Corbot::Jpeg_var jpeg = servant_->Picture(marked);
    return std::vector<std::uint8_t>(jpeg->get_buffer(), jpeg->get_buffer() + jpeg->length());
  };
  const auto plain = bytes(false);
  ASSERT_GT(plain.size(), 1000U);
  EXPECT_EQ(plain[0], 0xff);
  EXPECT_EQ(plain[1], 0xd8);
  EXPECT_EQ(plain, cell::to_jpeg(bytes_, cell_.camera.size_px));
  const auto marked = bytes(true);
  EXPECT_NE(marked, plain);
  EXPECT_EQ(bytes(false), plain) << "marks stay out of the picture itself";
  peer_.reset();
  EXPECT_THAT(refusal(1), testing::HasSubstr("Connection refused"));
  EXPECT_EQ(bytes(true), marked) << "a failed Look examines no picture";
}

TEST_F(Source, SilenceAndDripsEndAtTheDeadline) {
  peer_->reply_with(Peer::be_silent);
  EXPECT_THAT(refusal(0.2), testing::HasSubstr("no picture in time"));
  peer_->reply_with([&](int fd) {  // a header and then a byte at a time, for as long as the reader takes them
    const PictureHeader sent = header();
    Peer::send(fd, &sent, sizeof(sent));
    pollfd end{fd, POLLRDHUP, 0};
    while (::poll(&end, 1, 1) == 0) Peer::send(fd, bytes_.data(), 1);
  });
  EXPECT_THAT(refusal(0.3), testing::HasSubstr("no picture in time"));
  EXPECT_EQ(good_number(), 1U);
}

TEST_F(Source, NothingListens) {
  peer_.reset();
  EXPECT_THAT(refusal(1), testing::HasSubstr("Connection refused"));
  std::filesystem::remove(cell_.picture_socket());
  EXPECT_THAT(refusal(1), testing::HasSubstr("No such file"));
  peer_.emplace(cell_.picture_socket());
  EXPECT_EQ(good_number(), 1U);
}

TEST_F(Source, ATimeOutOutOfRangeIsRefusedWithItsValue) {
  for (const double timeout_s : {0.099, 60.1, -1.0, std::nan(""), HUGE_VAL}) {
    try {
      const Corbot::Frame_var frame = servant_->Look(timeout_s);
      FAIL() << timeout_s;
    } catch (const Corbot::BadParameter& error) {
      EXPECT_STREQ(error.parameter, "timeout");
      EXPECT_TRUE(error.value == timeout_s || std::isnan(timeout_s));
    }
  }
}

TEST_F(Source, LooksTakeTheirPicturesOneAfterAnother) {
  std::promise<void> triggered;
  std::promise<void> may_end;
  peer_->reply_with([&](int) {
    triggered.set_value();
    may_end.get_future().wait();
  });
  std::string first;
  std::jthread other([&] { first = refusal(60); });
  triggered.get_future().wait();
  try {
    const Corbot::Frame_var frame = servant_->Look(0.1);
    ADD_FAILURE() << "two at once";
  } catch (const Corbot::NotReady& error) {
    EXPECT_THAT(error.reason.in(), testing::HasSubstr("other calls"));
  }
  may_end.set_value();
  other.join();
  EXPECT_THAT(first, testing::HasSubstr("closed"));
  EXPECT_EQ(good_number(), 1U);
}

}  // namespace
}  // namespace corbot::test
