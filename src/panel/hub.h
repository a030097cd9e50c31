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

/// A Stop that was requested, of one robot or of several.
class StopOrder {
 public:
  void add(RobotWatch& robot) { robots_.emplace_back(&robot, robot.request_stop()); }
  [[nodiscard]] bool is_empty() const { return robots_.empty(); }
  /// Nothing before all have ended. {"robots": [{"robot": …, "stopped": true}, {…, "stopped": false, "text": …}]}
  [[nodiscard]] std::optional<nlohmann::json> result() const;

 private:
  std::vector<std::pair<RobotWatch*, std::uint64_t>> robots_;
};

/// One connection of a browser. All of it runs in the server's thread.
class Session : public std::enable_shared_from_this<Session> {
 public:
  using Clock = std::chrono::steady_clock;
  Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  virtual ~Session() = default;

  /// A robot has a new state, or a Stop has ended. Each WebSocket gets it.
  virtual void on_change() = 0;
  virtual void close() = 0;
  /// Since when it has waited for a request.
  [[nodiscard]] Clock::time_point idle_since() const { return idle_since_; }

 protected:
  void begin_idle() { idle_since_ = Clock::now(); }

 private:
  Clock::time_point idle_since_{Clock::now()};
};

/// What the connections of one server share.
class Hub {
 public:
  Hub(ServerSettings settings, std::vector<std::unique_ptr<RobotWatch>> robots);
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;
  ~Hub();

  /// Requests a Stop at once: of all robots for {}, of one for {"robot": NAME}. An empty order: none is wanted that is possible.
  [[nodiscard]] StopOrder stop(const nlohmann::json& wanted) const;
  [[nodiscard]] nlohmann::json descriptions() const;

  /// Makes room where there are too many.
  void add_request(const std::shared_ptr<Session>& session);
  [[nodiscard]] bool has_room_for_socket();
  void add_socket(const std::shared_ptr<Session>& session) { sockets_.push_back(session); }
  /// Keeps it until the next on_change(), which it gets.
  void hold(std::shared_ptr<Session> session) { held_.push_back(std::move(session)); }
  void on_change();

  const ServerSettings settings;
  const PageFiles pages;
  boost::asio::io_context io{1};
  const std::vector<std::unique_ptr<RobotWatch>> robots;  // they post to io: their threads end before it does

 private:
  using Sessions = std::list<std::weak_ptr<Session>>;
  Sessions requests_;
  Sessions sockets_;
  std::vector<std::shared_ptr<Session>> held_;
};

}  // namespace corbot::panel
