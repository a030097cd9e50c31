// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/object_rules.h"

#include <algorithm>

namespace corbot::sim {
namespace {

void put(std::vector<ObjectPattern>& patterns, const ObjectPattern& where, bool is_in) {
  std::erase(patterns, where);
  if (is_in) patterns.push_back(where);
}

bool any_fits(const std::vector<ObjectPattern>& patterns, ObjectKey key) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const ObjectPattern& p) { return p.fits(key); });
}

}  // namespace

void ObjectRules::set_when(const ObjectPattern& where, WriteWhen when) {
  std::erase_if(timings_, [&](const Timing& timing) { return timing.where == where; });
  timings_.push_back({where, when});
}

void ObjectRules::set_missing(const ObjectPattern& where, bool is_missing) {
  put(missing_, where, is_missing);
}

void ObjectRules::set_unanswered(const ObjectPattern& where, bool is_unanswered) {
  put(unanswered_, where, is_unanswered);
}

void ObjectRules::apply_to(CanObjects& objects) const {
  for (const auto& [key, value] : values_) objects.set(key, value);
  objects.hide([this](ObjectKey key) { return any_fits(missing_, key); });
}

WriteWhen ObjectRules::when(ObjectKey key) const {
  const auto found =
      std::find_if(timings_.rbegin(), timings_.rend(), [&](const Timing& t) { return t.where.fits(key); });
  return found == timings_.rend() ? WriteWhen::kAlways : found->when;
}

bool ObjectRules::is_unanswered(ObjectKey key) const { return any_fits(unanswered_, key); }

}  // namespace corbot::sim
