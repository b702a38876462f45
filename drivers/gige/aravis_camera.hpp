#pragma once

#include <arv.h>
#include <netinet/in.h>

#include <functional>
#include <memory>
#include <string_view>

#include "drivers/gige/aravis_source.hpp"

namespace hueline::drivers {

struct Unreference {
  void operator()(gpointer object) const { g_object_unref(object); }
};
/// One reference to a GObject.
template <class T>
using GRef = std::unique_ptr<T, Unreference>;

/// Takes the GError: Invalid where the camera lacks or refuses a setting, else Unavailable.
Error take_error(std::string_view attempted, GError* error);

/// Finds and connects the camera that `config` names, and makes sure that it is that one and that we control it.
/// `on_control` is called as soon as it is ours.
Result<GRef<ArvCamera>> connect_camera(const AravisSource::Config& config,
                                       const std::function<void(ArvDevice&)>& on_control);
sockaddr_in ipv4_of(GSocketAddress* address);

/// Applies the settings and reads back region and pixel format: Invalid if the camera made something else of them.
Status configure_camera(ArvCamera* camera, const AravisSource::Config& config);

}  // namespace hueline::drivers
