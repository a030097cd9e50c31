// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "net/places.h"

namespace corbot::omni {

/// The place of a call of the present thread, as long as the object lives.
class Place {
 public:
  /// Throws Corbot::QueueFull when there is none.
  explicit Place(corbot_place_kind kind);
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  ~Place() { corbot_place_free(place_); }

  /// Whether the client is still there.
  [[nodiscard]] bool is_wanted() const { return corbot_place_wanted(place_); }

 private:
  int place_;
};

/// From now on each thread of the ORB knows on which connection the request came that it carries out. After
/// the ORB's start, before it serves.
void note_connections();

}  // namespace corbot::omni
