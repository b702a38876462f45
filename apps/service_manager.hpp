#pragma once

#include <string>

/// What the service manager (systemd, sd_notify(3)) is told of this process. If no manager asked for it, these
/// functions do nothing. Thread-safe.
namespace hueline::apps::service_manager {

/// The program does its work now.
void tell_ready();
/// The program is alive; `status` is one line for `systemctl status`. The manager restarts a program that does not say
/// so within the time that its unit gives (WatchdogSec).
void tell_alive(const std::string& status);
/// The program ends. The manager no longer waits for tell_alive().
void tell_stopping();

}  // namespace hueline::apps::service_manager
