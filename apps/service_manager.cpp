#include "apps/service_manager.hpp"

#include <systemd/sd-daemon.h>

namespace hueline::apps::service_manager {

// A manager that cannot be told is no reason to end a drive: errors are of no use here.
void tell_ready() { (void)sd_notify(0, "READY=1"); }
void tell_alive(const std::string& status) { (void)sd_notify(0, ("WATCHDOG=1\nSTATUS=" + status).c_str()); }
// systemd 252 would go on to wait for tell_alive() from a service that stops, and kill it while it processes what has
// come.
void tell_stopping() { (void)sd_notify(0, "STOPPING=1\nWATCHDOG_USEC=0"); }

}  // namespace hueline::apps::service_manager
