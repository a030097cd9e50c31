// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "corbot/channel/ring.h"

namespace corbot {

/// Lets a test do to a ring what a hostile or broken process could: write any index.
struct RingIndices {
  template <class Ring>
  static void set_indices(Ring& ring, std::uint64_t head, std::uint64_t tail) {
    ring.slots.head_.store(head);
    ring.tail.tail_.store(tail);
  }
  template <class Ring>
  static void set_head(Ring& ring, std::uint64_t head) {
    ring.slots.head_.store(head);
  }
  template <class Record, std::size_t kCapacity>
  static void set_head(RingSlots<Record, kCapacity>& slots, std::uint64_t head) {
    slots.head_.store(head);
  }
  /// Returns the record of that index.
  template <class Record, std::size_t kCapacity>
  static Record& record(RingSlots<Record, kCapacity>& slots, std::uint64_t index) {
    return slots.slots_[index & (kCapacity - 1)].value;
  }
  template <class Ring>
  static void set_tail(Ring& ring, std::uint64_t tail) {
    ring.tail.tail_.store(tail);
  }
};

}  // namespace corbot
