// SPDX-License-Identifier: Apache-2.0
#include "panel/hub.h"

#include <algorithm>

namespace corbot::panel {

namespace {

using nlohmann::json;

void forget_closed(std::list<std::weak_ptr<Session>>& sessions) {
  sessions.remove_if([](const std::weak_ptr<Session>& session) { return session.expired(); });
}

}  // namespace

std::optional<json> StopOrder::result() const {
  json list = json::array();
  for (const auto& [robot, number] : robots_) {
    const RobotWatch::StopResult last = robot->last_stop();
    if (last.number < number) return std::nullopt;
    json entry{{"robot", robot->name()}, {"stopped", last.failure.empty()}};
    if (!last.failure.empty()) entry["text"] = last.failure;
    list.push_back(std::move(entry));
  }
  return json{{"robots", std::move(list)}};
}

Hub::Hub(ServerSettings given, std::vector<std::unique_ptr<RobotWatch>> watched)
    : settings(std::move(given)), pages(settings.pages), robots(std::move(watched)) {}

Hub::~Hub() {
  for (const auto& robot : robots) robot->end();
}

StopOrder Hub::stop(const json& wanted) const {
  StopOrder order;
  if (!wanted.is_object()) return order;
  const auto name = wanted.find("robot");
  for (const auto& robot : robots) {
    if (name == wanted.end() || *name == robot->name()) order.add(*robot);
  }
  return order;
}

RobotWatch* Hub::find(const json& name) const {
  const auto found =
      std::find_if(robots.begin(), robots.end(), [&](const auto& robot) { return name == robot->name(); });
  return found == robots.end() ? nullptr : found->get();
}

json Hub::descriptions() const {
  json list = json::array();
  for (const auto& robot : robots) {
    json description = robot->description();
    description["robot"] = robot->name();
    list.push_back(std::move(description));
  }
  return list;
}

void Hub::add_request(const std::shared_ptr<Session>& session) {
  forget_closed(requests_);
  while (requests_.size() >= settings.most_requests) {
    auto oldest = requests_.begin();
    std::shared_ptr<Session> closing = oldest->lock();
    for (auto other = std::next(oldest); other != requests_.end(); ++other) {
      if (const auto found = other->lock(); found && found->idle_since() < closing->idle_since()) {
        oldest = other;
        closing = found;
      }
    }
    closing->close();
    requests_.erase(oldest);
  }
  requests_.push_back(session);
}

bool Hub::has_room_for_socket() {
  forget_closed(sockets_);
  return sockets_.size() < settings.most_sockets;
}

void Hub::on_change() {
  for (const auto& session : std::exchange(held_, {})) session->on_change();
  for (const std::weak_ptr<Session>& one : sockets_) {
    if (const auto session = one.lock()) session->on_change();
  }
}

}  // namespace corbot::panel
