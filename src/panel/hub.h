// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panel/page_files.h"
#include "panel/server_settings.h"
#include "panel/watch.h"

namespace corbot::panel {

/// A requested Stop of one or several robots and cells.
class StopOrder {
 public:
  void add(Watch& watch) { orders_.emplace_back(&watch, watch.request_stop()); }
  [[nodiscard]] bool is_empty() const { return orders_.empty(); }
  /// Returns nothing before all these Stops have ended. The result has the form
  /// {"robots": [{"robot": …, "stopped": true}, {…, "stopped": false, "text": …}], "cells": [{"cell": …}]}
  [[nodiscard]] std::optional<nlohmann::json> result() const;

 private:
  std::vector<std::pair<Watch*, std::uint64_t>> orders_;
};

/// One connection of a browser. All its functions run in the server's thread.
class Session : public std::enable_shared_from_this<Session> {
 public:
  using Clock = std::chrono::steady_clock;
  Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  virtual ~Session() = default;

  /// The hub calls it when a robot or cell has a new state or a Stop has ended.
  virtual void on_change() = 0;
  virtual void close() = 0;
  /// Returns the time since which the connection has waited for a request; the latest one during a Stop or a
  /// call.
  [[nodiscard]] Clock::time_point idle_since() const { return idle_since_; }

 protected:
  void begin_idle() { idle_since_ = Clock::now(); }
  void end_idle() { idle_since_ = Clock::time_point::max(); }

 private:
  Clock::time_point idle_since_{Clock::now()};
};

/// The robots, cells, pages and sessions that all connections of one server share.
class Hub {
 public:
  Hub(ServerSettings settings, std::vector<std::unique_ptr<Watch>> watches);
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;
  ~Hub();

  /// Requests Stops at once, and counts: {} stops all robots and cells, {"robot": NAME} or {"cell": NAME}
  /// stops one. The order is empty if `wanted` is no object or names none of this panel.
  [[nodiscard]] StopOrder stop(const nlohmann::json& wanted);
  /// Returns what {"robot": NAME} or {"cell": NAME} names; null if there is none.
  [[nodiscard]] Watch* find(const nlohmann::json& wanted) const;
  [[nodiscard]] nlohmann::json descriptions(Watched what) const;

  /// Adds a connection. If there are too many, closes those that have been idle for longest.
  void add_request(const std::shared_ptr<Session>& session);
  [[nodiscard]] bool has_room_for_socket();
  void add_socket(const std::shared_ptr<Session>& session) { sockets_.push_back(session); }
  /// Keeps the session until the next on_change(), which calls that of the session.
  void hold(std::shared_ptr<Session> session) { held_.push_back(std::move(session)); }
  void on_change();

  const ServerSettings settings;
  const PageFiles pages;
  /// One number for all, since a cell moves its robots. All states have it as "stops".
  std::atomic<std::uint64_t> received_stops{0};
  boost::asio::io_context io{1};
  const std::vector<std::unique_ptr<Watch>> watches;  // declared after io: their threads post to io

 private:
  using Sessions = std::list<std::weak_ptr<Session>>;
  Sessions requests_;
  Sessions sockets_;
  std::vector<std::shared_ptr<Session>> held_;
};

}  // namespace corbot::panel
