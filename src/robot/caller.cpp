// SPDX-License-Identifier: Apache-2.0
#include "robot/caller.h"

#include <fmt/format.h>

#include <utility>

#include "robot/call_error.h"

namespace corbot {
namespace {

int presence_of(const corbot_caller* caller) {
  return caller == nullptr || caller->present == nullptr ? CORBOT_CALLER_PRESENT
                                                         : caller->present(caller->context);
}

}  // namespace

std::string key_of(const corbot_caller* caller) {
  return caller != nullptr && caller->key != nullptr ? caller->key : "";
}

std::string from_of(const corbot_caller* caller) {
  return caller != nullptr && caller->from != nullptr ? caller->from : "";
}

corbot_counted_stop counted_of(const corbot_caller* caller) {
  return caller != nullptr ? caller->counted : corbot_counted_stop{};
}

bool is_present(const corbot_caller* caller) { return presence_of(caller) != CORBOT_CALLER_GONE; }

Wanted wanted_to_start(const corbot_caller* caller) {
  return [caller] {
    const int presence = presence_of(caller);
    if (presence == CORBOT_CALLER_GONE) throw not_ready("the connection of the caller is lost");
    if (presence == CORBOT_CALLER_CROWDED) throw calls_full(caller->places);
  };
}

Wanted wanted_to_change(const corbot_caller* caller, std::string otherwise) {
  return [caller, otherwise = std::move(otherwise)] {
    const int presence = presence_of(caller);
    if (presence == CORBOT_CALLER_GONE) throw not_ready("the connection of the caller is lost");
    if (presence == CORBOT_CALLER_CROWDED)
      throw not_ready(fmt::format(
          "not confirmed at once, and {0} other calls of this host are blocked, {0} are allowed; {1}",
          caller->places, otherwise));
  };
}

}  // namespace corbot
