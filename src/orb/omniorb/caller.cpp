// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/caller.h"

#include <utility>

namespace corbot::omni {
namespace {

int presence(void* place) { return static_cast<const Place*>(place)->presence(); }

}  // namespace

Caller::Caller(std::string key, const Place* place) : key_(std::move(key)) {
  corbot_connection_peer_text(connection_of_call(), from_);
  caller_.present = place != nullptr ? presence : nullptr;
  caller_.context = const_cast<Place*>(place);
  caller_.places = CORBOT_HOST_PLACES;
  caller_.key = key_.c_str();
  caller_.from = from_;
  caller_.stops = arrival_of_call();
  caller_.counted = counted_stop_of_call();
}

}  // namespace corbot::omni
