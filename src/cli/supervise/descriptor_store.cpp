// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/descriptor_store.h"

#include <fcntl.h>
#include <linux/kcmp.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

namespace corbot::cli {

namespace {

/// Implements systemd's rule: printable ASCII without a colon, at most 255 characters.
bool is_fd_name(std::string_view name) {
  return !name.empty() && name.size() <= 255 &&
         std::all_of(name.begin(), name.end(), [](char c) { return c >= ' ' && c < 127 && c != ':'; });
}

bool is_same_open_file(int a, int b) {
  const pid_t self = ::getpid();
  return ::syscall(SYS_kcmp, self, self, KCMP_FILE, a, b) == 0;
}

}  // namespace

Descriptor above_passed(Descriptor fd) noexcept {
  if (fd.get() >= DescriptorStore::kFirstFree) return fd;
  return Descriptor(::fcntl(fd.get(), F_DUPFD_CLOEXEC, DescriptorStore::kFirstFree));
}

DescriptorStore::Added DescriptorStore::add(const std::string& name, Descriptor fd) {
  const bool known = std::any_of(items_.begin(), items_.end(), [&](const Item& item) {
    return is_same_open_file(item.fd.get(), fd.get());
  });
  if (known) return Added::kAlreadyThere;
  if (items_.size() >= kCapacity) return Added::kFull;
  Descriptor kept = above_passed(std::move(fd));
  if (kept.get() < 0) return Added::kFailed;
  items_.push_back({is_fd_name(name) ? name : "stored", std::move(kept)});
  return Added::kNew;
}

std::size_t DescriptorStore::remove(std::string_view name) {
  return std::erase_if(items_, [&](const Item& item) { return item.name == name; });
}

std::string DescriptorStore::names() const {
  std::string text;
  for (const Item& item : items_) text += (text.empty() ? "" : ":") + item.name;
  return text;
}

}  // namespace corbot::cli
