// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/service_manager.h"

#include <systemd/sd-daemon.h>

#include <cstdint>
#include <cstdlib>
#include <utility>

namespace corbot::cli {

namespace {

constexpr int kFeedsPerInterval = 4;

std::string full_name(const std::string& title, const std::string& name) { return title + "/" + name; }

}  // namespace

ServiceManager::ServiceManager() {
  char** names = nullptr;
  const int count = ::sd_listen_fds_with_names(1, &names);
  for (int i = 0; i < count; ++i) {
    kept_.push_back({names[i], Descriptor(SD_LISTEN_FDS_START + i)});
    std::free(names[i]);
  }
  std::free(names);
  std::uint64_t interval_us = 0;
  if (::sd_watchdog_enabled(0, &interval_us) > 0) interval_ = std::chrono::microseconds(interval_us);
}

std::vector<DescriptorStore::Item> ServiceManager::take(const std::string& title) {
  const std::string prefix = full_name(title, "");
  std::vector<DescriptorStore::Item> taken;
  for (DescriptorStore::Item& item : kept_) {
    if (item.name.starts_with(prefix) && item.fd.get() >= 0)
      taken.push_back({item.name.substr(prefix.size()), std::move(item.fd)});
  }
  return taken;
}

void ServiceManager::store(const std::string& title, const std::string& name, int fd) const {
  // FDPOLL=0: systemd keeps the descriptor whatever poll(2) returns for it.
  const std::string text = "FDSTORE=1\nFDPOLL=0\nFDNAME=" + full_name(title, name);
  (void)::sd_pid_notify_with_fds(0, 0, text.c_str(), &fd, 1);
}

void ServiceManager::remove(const std::string& title, const std::string& name) const {
  (void)::sd_notify(0, ("FDSTOREREMOVE=1\nFDNAME=" + full_name(title, name)).c_str());
}

void ServiceManager::ready(const std::string& status) const {
  (void)::sd_notify(0, ("READY=1\nSTATUS=" + status).c_str());
}

void ServiceManager::feed() {
  const auto now = std::chrono::steady_clock::now();
  if (interval_.count() == 0 || now - fed_ < interval_ / kFeedsPerInterval) return;
  fed_ = now;
  (void)::sd_notify(0, "WATCHDOG=1");
}

void ServiceManager::ending() const { (void)::sd_notify(0, "STOPPING=1\nSTATUS=ending"); }

}  // namespace corbot::cli
