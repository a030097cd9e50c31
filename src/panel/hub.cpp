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
  json result{{"robots", json::array()}};
  for (const auto& [watch, number] : orders_) {
    const Watch::StopResult last = watch->last_stop();
    if (last.number < number) return std::nullopt;
    json entry{{watch->key(), watch->name()}, {"stopped", last.failure.empty()}};
    if (!last.failure.empty()) entry["text"] = last.failure;
    result[watch->is_for(Watched::kRobot) ? "robots" : "cells"].push_back(std::move(entry));
  }
  return result;
}

Hub::Hub(ServerSettings given, std::vector<std::unique_ptr<Watch>> watched)
    : settings(std::move(given)), pages(settings.pages), watches(std::move(watched)) {}

Hub::~Hub() {
  for (const auto& watch : watches) watch->end();
}

StopOrder Hub::stop(const json& wanted) {
  StopOrder order;
  if (!wanted.is_object()) return order;
  ++received_stops;
  if (wanted.contains("robot") || wanted.contains("cell")) {
    if (Watch* const one = find(wanted)) order.add(*one);
    return order;
  }
  for (const auto& watch : watches) order.add(*watch);
  return order;
}

Watch* Hub::find(const json& wanted) const {
  if (!wanted.is_object() || wanted.contains("robot") == wanted.contains("cell")) return nullptr;
  const auto found = std::find_if(watches.begin(), watches.end(), [&](const auto& watch) {
    const auto name = wanted.find(watch->key());
    return name != wanted.end() && *name == watch->name();
  });
  return found == watches.end() ? nullptr : found->get();
}

json Hub::descriptions(Watched what) const {
  json list = json::array();
  for (const auto& watch : watches) {
    if (!watch->is_for(what)) continue;
    json description = watch->description();
    description[watch->key()] = watch->name();
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
