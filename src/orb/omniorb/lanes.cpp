// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/lanes.h"

#include <algorithm>

#include <arm.hh>

namespace corbot::omni {

Lanes::Lanes(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) lanes_.push_back(std::make_unique<Lane>());
}

void Lanes::set_reference(std::size_t lane, CORBA::Object_ptr reference) {
  lanes_.at(lane)->reference = CORBA::Object::_duplicate(reference);
}

bool Lanes::idle() const noexcept {
  return std::all_of(lanes_.begin(), lanes_.end(), [](const auto& lane) { return lane->held.load() == 0; });
}

Lanes::Place Lanes::enter(std::size_t lane) {
  std::atomic<int>& held = lanes_.at(lane)->held;
  if (held.fetch_add(1) < kCallsPerLane) return Place(held);
  held.fetch_sub(1);
  for (std::size_t i = 1; i < lanes_.size(); ++i) {
    const Lane& other = *lanes_[(lane + i) % lanes_.size()];
    if (other.held.load() < kCallsPerLane && !CORBA::is_nil(other.reference)) {
      throw omniORB::LOCATION_FORWARD(CORBA::Object::_duplicate(other.reference));
    }
  }
  throw Corbot::QueueFull(capacity());
}

}  // namespace corbot::omni
