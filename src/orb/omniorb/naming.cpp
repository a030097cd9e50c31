// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/naming.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

namespace corbot::omni {
namespace {

constexpr auto kPollPeriod = std::chrono::seconds(1);
constexpr CORBA::ULong kCallTimeout_ms = 2000;  // a service that hangs must not delay the servant's end

}  // namespace

NameBinder::NameBinder(CORBA::ORB_ptr orb, std::string service, std::string robot,
                       CORBA::Object_ptr reference)
    : orb_(CORBA::ORB::_duplicate(orb)),
      service_(std::move(service)),
      robot_(std::move(robot)),
      reference_(CORBA::Object::_duplicate(reference)) {
  name_.length(2);
  name_[0].id = CORBA::string_dup("Robots");
  name_[0].kind = CORBA::string_dup("");
  name_[1].id = CORBA::string_dup(robot_.c_str());
  name_[1].kind = CORBA::string_dup("Robot");
  thread_ = std::thread([this] { run(); });
}

NameBinder::~NameBinder() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  end_requested_.notify_all();
  thread_.join();
}

void NameBinder::run() {
  std::unique_lock lock(mutex_);
  while (!end_) {
    lock.unlock();
    keep_bound();
    lock.lock();
    if (!end_) end_requested_.wait_for(lock, kPollPeriod);
  }
  lock.unlock();
  unbind();
}

CosNaming::NamingContext_ptr NameBinder::root() const {
  // Created anew each time: a reference that once failed may have been forwarded to a service that has ended.
  CORBA::Object_var object = orb_->string_to_object(service_.c_str());
  omniORB::setClientCallTimeout(object, kCallTimeout_ms);
  CosNaming::NamingContext_var context = CosNaming::NamingContext::_narrow(object);
  if (CORBA::is_nil(context)) throw CORBA::INV_OBJREF();
  omniORB::setClientCallTimeout(context, kCallTimeout_ms);
  return context._retn();
}

bool NameBinder::is_ours(CosNaming::NamingContext_ptr context) const {
  try {
    CORBA::Object_var found = context->resolve(name_);
    return !CORBA::is_nil(found) && found->_is_equivalent(reference_);
  } catch (const CosNaming::NamingContext::NotFound&) {
    return false;
  }
}

void NameBinder::keep_bound() {
  try {
    CosNaming::NamingContext_var context = root();
    if (is_ours(context)) {
      bound_ = true;  // perhaps an earlier process of this servant, which was killed, bound it
      return;
    }
    CosNaming::Name robots;
    robots.length(1);
    robots[0] = name_[0];
    try {
      CosNaming::NamingContext_var created = context->bind_new_context(robots);
    } catch (const CosNaming::NamingContext::AlreadyBound&) {
      // The usual case: another robot, or an earlier process of this one, created it.
    }
    context->rebind(name_, reference_);
    spdlog::info("{} as Robots/{}.Robot in {}", bound_ ? "named again" : "named", robot_, service_);
    bound_ = true;
    has_warned_ = false;
  } catch (const CORBA::Exception& error) {
    if (!std::exchange(has_warned_, true)) {
      spdlog::warn("naming service {}: {}; going on without it and trying again", service_, error._name());
    }
  }
}

void NameBinder::unbind() {
  if (!bound_) return;
  try {
    CosNaming::NamingContext_var context = root();
    if (is_ours(context)) context->unbind(name_);
  } catch (const CORBA::Exception& error) {
    spdlog::warn("naming service {}: {}; Robots/{}.Robot stays bound", service_, error._name(), robot_);
  }
}

}  // namespace corbot::omni
