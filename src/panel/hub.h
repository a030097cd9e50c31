// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panel/page_files.h"
#include "panel/robot_watch.h"
#include "panel/server_settings.h"

namespace corbot::panel {

/// A requested Stop of one or several robots.
class StopOrder {
 public:
  void add(RobotWatch& robot) { robots_.emplace_back(&robot, robot.request_stop()); }
  [[nodiscard]] bool is_empty() const { return robots_.empty(); }
  /// Returns nothing before the Stops of all robots have ended. The result has the form
  /// {"robots": [{"robot": …, "stopped": true}, {…, "stopped": false, "text": …}]}
  [[nodiscard]] std::optional<nlohmann::json> result() const;

 private:
  std::vector<std::pair<RobotWatch*, std::uint64_t>> robots_;
};

/// One connection of a browser. All its functions run in the server's thread.
class Session : public std::enable_shared_from_this<Session> {
 public:
  using Clock = std::chrono::steady_clock;
  Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  virtual ~Session() = default;

  /// The hub calls it when a robot has a new state or a Stop has ended.
  virtual void on_change() = 0;
  virtual void close() = 0;
  /// Returns the time since which the connection has waited for a request.
  [[nodiscard]] Clock::time_point idle_since() const { return idle_since_; }

 protected:
  void begin_idle() { idle_since_ = Clock::now(); }

 private:
  Clock::time_point idle_since_{Clock::now()};
};

/// The robots, pages and sessions that all connections of one server share.
class Hub {
 public:
  Hub(ServerSettings settings, std::vector<std::unique_ptr<RobotWatch>> robots);
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;
  ~Hub();

  /// Requests Stops at once: {} stops all robots, {"robot": NAME} stops one. The order is empty if `wanted`
  /// is no object or names an unknown robot.
  [[nodiscard]] StopOrder stop(const nlohmann::json& wanted) const;
  /// Returns the robot of that name; null if there is none.
  [[nodiscard]] RobotWatch* find(const nlohmann::json& name) const;
  [[nodiscard]] nlohmann::json descriptions() const;

  /// Adds a connection. If there are too many, closes those that have been idle for longest.
  void add_request(const std::shared_ptr<Session>& session);
  [[nodiscard]] bool has_room_for_socket();
  void add_socket(const std::shared_ptr<Session>& session) { sockets_.push_back(session); }
  /// Keeps the session until the next on_change(), which calls that of the session.
  void hold(std::shared_ptr<Session> session) { held_.push_back(std::move(session)); }
  void on_change();

  const ServerSettings settings;
  const PageFiles pages;
  boost::asio::io_context io{1};
  const std::vector<std::unique_ptr<RobotWatch>> robots;  // declared after io: their threads post to io

 private:
  using Sessions = std::list<std::weak_ptr<Session>>;
  Sessions requests_;
  Sessions sockets_;
  std::vector<std::shared_ptr<Session>> held_;
};

}  // namespace corbot::panel
