#pragma once

#include <arv.h>
#include <netinet/in.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "drivers/gige/aravis_source.hpp"

namespace hueline::drivers {

/// Deleter of GRef.
struct Unreference {
  void operator()(gpointer object) const { g_object_unref(object); }
};
/// Owns one reference to a GObject.
template <class T>
using GRef = std::unique_ptr<T, Unreference>;

/// Frees `error` and returns it as an Error: Invalid if the camera lacks or refuses a setting, else Unavailable.
/// `attempted` says in messages what failed.
Error take_error(std::string_view attempted, GError* error);

/// Finds the GigE camera that `config` names and connects to it. Checks that it is that camera and that this program
/// controls it. Calls `on_control` as soon as it does.
Result<GRef<ArvCamera>> connect_camera(const AravisSource::Config& config,
                                       const std::function<void(ArvDevice&)>& on_control);
/// Returns the serial number of the USB3 Vision camera that Aravis lists by this name (maker-GUID-serial), or that has
/// this GUID, or this maker, model and serial with hyphens between; empty if there is none. Aravis opens every such
/// camera to look at it.
std::string usb3_serial_of(const std::string& id);
/// Returns the IPv4 address and port of `address`.
sockaddr_in ipv4_of(GSocketAddress* address);

/// Applies the settings, then reads back the region and the pixel format. Returns Invalid if they differ from `config`.
Status configure_camera(ArvCamera* camera, const AravisSource::Config& config);

}  // namespace hueline::drivers
