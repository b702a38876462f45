#include "drivers/gige/aravis_camera.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <mutex>
#include <string>
#include <utility>

#include "drivers/gige/image_packet.hpp"
#include "drivers/transport/file_descriptor.hpp"

namespace hueline::drivers {

namespace {

/// Runs calls of Aravis one after the other, until one fails.
class Steps {
 public:
  template <class Call>
  void operator()(std::string_view what, Call&& call) {
    if (!status_) return;
    GError* error = nullptr;
    call(&error);
    if (error) status_ = take_error(what, error);
  }
  void fail(const Error& error) {
    if (status_) status_ = error;
  }
  const Status& status() const { return status_; }

 private:
  Status status_;
};

using OnControl = std::function<void(ArvDevice&)>;

/// Checks that this computer has the address. Aravis 0.8.26 crashes if it cannot bind its socket to it.
Status check_own_address(const std::string& interface) {
  sockaddr_in own{};
  own.sin_family = AF_INET;
  const FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (::inet_pton(AF_INET, interface.c_str(), &own.sin_addr) == 1 && socket &&
      ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&own), sizeof(own)) == 0)
    return {};
  return Error{
      ErrorCode::Unavailable,
      fmt::format("interface: this computer has no address {} now ({}); set it to the computer's own address in "
                  "the camera's network, which `ip address` shows, or give the interface this one",
                  interface, std::strerror(errno))};
}

Result<GRef<ArvCamera>> connect_at(const std::string& interface, const std::string& address,
                                   const OnControl& on_control) {
  const GRef<GInetAddress> own(g_inet_address_new_from_string(interface.c_str()));
  const GRef<GInetAddress> peer(g_inet_address_new_from_string(address.c_str()));
  if (!own || !peer)
    return Error{ErrorCode::Invalid, fmt::format("'{}' or '{}' is not an IPv4 address", interface, address)};
  if (const Status has_address = check_own_address(interface); !has_address) return has_address.error();
  GError* error = nullptr;
  const GRef<ArvDevice> device(arv_gv_device_new(own.get(), peer.get(), &error));
  if (error) return take_error(fmt::format("connect to camera {} by {}", address, interface), error);
  if (on_control) on_control(*device);
  GRef<ArvCamera> camera(arv_camera_new_with_device(device.get(), &error));
  if (error) return take_error(fmt::format("read the description of camera {}", address), error);
  return camera;
}

constexpr const char* kGigeVision = "GigEVision";
constexpr const char* kUsb3Vision = "USB3Vision";

/// While an object of this class lives, Aravis looks for cameras on this transport only. The choice, and the list of
/// the cameras that were found, belong to the whole process, so two cameras do not search at the same time.
class LookOn {
 public:
  explicit LookOn(const char* transport) : lock_(searching()) {
    for (unsigned i = 0; i < arv_get_n_interfaces(); ++i) arv_disable_interface(arv_get_interface_id(i));
    arv_enable_interface(transport);
  }

 private:
  static std::mutex& searching() {
    static std::mutex mutex;
    return mutex;
  }
  std::lock_guard<std::mutex> lock_;
};

Result<GRef<ArvCamera>> connect_by_name(const std::string& id, const OnControl& on_control) {
  GError* error = nullptr;
  GRef<ArvCamera> camera(arv_camera_new(id.c_str(), &error));
  if (error) return take_error(fmt::format("connect to camera {}", id), error);
  if (!camera) return Error{ErrorCode::Unavailable, fmt::format("no camera {}", id)};
  if (on_control) on_control(*arv_camera_get_device(camera.get()));
  return camera;
}

Result<GRef<ArvCamera>> connect_by_serial(const std::string& serial, const OnControl& on_control) {
  arv_update_device_list();
  for (unsigned i = 0; i < arv_get_n_devices(); ++i)
    if (const char* found = arv_get_device_serial_nbr(i); found && serial == found)
      return connect_by_name(arv_get_device_id(i), on_control);
  return Error{ErrorCode::Unavailable, fmt::format("no camera with serial number {}", serial)};
}

bool is_loopback(ArvGvDevice* device) {
  GInetAddress* own =
      g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(arv_gv_device_get_interface_address(device)));
  return g_inet_address_get_is_loopback(own);
}

void configure_trigger(ArvCamera* camera, const AravisSource::Config& config, Steps& steps) {
  if (!config.trigger_source.empty()) {
    steps("trigger_source", [&](GError** e) { arv_camera_set_trigger(camera, config.trigger_source.c_str(), e); });
    if (config.trigger_activation == TriggerActivation::FallingEdge)
      steps("trigger_activation",
            [&](GError** e) { arv_camera_set_string(camera, "TriggerActivation", "FallingEdge", e); });
    return;
  }
  if (arv_camera_is_feature_available(camera, "TriggerMode", nullptr))
    steps("no trigger", [&](GError** e) { arv_camera_clear_triggers(camera, e); });
  if (config.frame_rate_hz > 0)
    steps("frame_rate_hz", [&](GError** e) { arv_camera_set_frame_rate(camera, config.frame_rate_hz, e); });
}

/// Has the camera choose its exposures, up to the longest one. Makers have different names for that limit.
void configure_auto_exposure(ArvCamera* camera, const AravisSource::Config& config, Steps& steps) {
  steps("auto_exposure", [&](GError** e) { arv_camera_set_exposure_time_auto(camera, ARV_AUTO_CONTINUOUS, e); });
  if (!config.exposure) return;
  for (const char* limit : {"AutoExposureExposureTimeUpperLimit", "AutoExposureTimeUpperLimit",
                            "AutoExposureTimeAbsUpperLimit", "ExposureAutoMax", "ExposureTimeUpperLimit"}) {
    if (!arv_camera_is_feature_available(camera, limit, nullptr)) continue;
    const double us = static_cast<double>(config.exposure->count()) * 1e-3;
    ArvGcNode* node = arv_device_get_feature(arv_camera_get_device(camera), limit);
    steps(limit, [&](GError** e) {
      if (ARV_IS_GC_FLOAT(node))
        arv_camera_set_float(camera, limit, us, e);
      else
        arv_camera_set_integer(camera, limit, std::llround(us), e);
    });
    return;
  }
}

/// Has the camera send its exposure and gain as chunks, if it can.
void configure_chunks(ArvCamera* camera, const AravisSource::Config& config, Steps& steps) {
  if (!config.chunks) return;
  const auto offers = [&](const char* chunk) {
    return arv_camera_is_enumeration_entry_available(camera, "ChunkSelector", chunk, nullptr) != FALSE;
  };
  const bool can = arv_camera_is_feature_available(camera, "ChunkModeActive", nullptr) && offers("ExposureTime");
  if (!can && config.auto_exposure)
    steps.fail(Error{ErrorCode::Invalid,
                     "camera: auto_exposure: the camera does not report its exposures (no chunk ExposureTime), so the "
                     "middle of an image would not be known; set auto_exposure: false"});
  if (!can) return;
  Steps chunks;
  const auto enable = [&](const char* chunk) {
    chunks(chunk, [&](GError** e) { arv_camera_set_string(camera, "ChunkSelector", chunk, e); });
    chunks(chunk, [&](GError** e) { arv_camera_set_boolean(camera, "ChunkEnable", TRUE, e); });
  };
  chunks("ChunkModeActive", [&](GError** e) { arv_camera_set_boolean(camera, "ChunkModeActive", TRUE, e); });
  enable("ExposureTime");
  if (offers("Gain")) enable("Gain");
  if (chunks.status()) return;
  // A camera whose exposures do not change serves without reports.
  if (config.auto_exposure)
    steps.fail(chunks.status().error());
  else
    arv_camera_set_boolean(camera, "ChunkModeActive", FALSE, nullptr);
}

void configure_light(ArvCamera* camera, const AravisSource::Config& config, Steps& steps) {
  if (config.auto_exposure) {
    configure_auto_exposure(camera, config, steps);
  } else if (config.exposure) {
    if (arv_camera_is_exposure_auto_available(camera, nullptr))
      steps("exposure", [&](GError** e) { arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, e); });
    const double us = static_cast<double>(config.exposure->count()) * 1e-3;
    steps("exposure", [&](GError** e) { arv_camera_set_exposure_time(camera, us, e); });
  }
  if (config.gain) {
    if (arv_camera_is_gain_auto_available(camera, nullptr))
      steps("gain", [&](GError** e) { arv_camera_set_gain_auto(camera, ARV_AUTO_OFF, e); });
    steps("gain", [&](GError** e) { arv_camera_set_gain(camera, *config.gain, e); });
  }
}

void configure_transport(ArvCamera* camera, const AravisSource::Config& config, Steps& steps) {
  if (!arv_camera_is_gv_device(camera)) return;
  if (!config.packet_socket || is_loopback(ARV_GV_DEVICE(arv_camera_get_device(camera))))
    arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size_adjustment(
      camera, config.packet_size ? ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER : ARV_GV_PACKET_SIZE_ADJUSTMENT_ALWAYS);
  if (config.packet_size)
    steps("packet_size",
          [&](GError** e) { arv_camera_gv_set_packet_size(camera, static_cast<gint>(config.packet_size), e); });
  if (config.packet_delay > nanoseconds(0))
    steps("packet_delay", [&](GError** e) { arv_camera_gv_set_packet_delay(camera, config.packet_delay.count(), e); });
}

Status check_settings(ArvCamera* camera, const AravisSource::Config& config) {
  Steps steps;
  gint x = 0, y = 0, width = 0, height = 0;
  ArvPixelFormat format = 0;
  steps("read the region", [&](GError** e) { arv_camera_get_region(camera, &x, &y, &width, &height, e); });
  steps("read the pixel format", [&](GError** e) { format = arv_camera_get_pixel_format(camera, e); });
  if (!steps.status()) return steps.status();
  if (format != pfnc_code(config.pixel_format))
    return Error{ErrorCode::Invalid,
                 fmt::format("pixel_format: the camera gives 0x{:08x} for {}", format, name(config.pixel_format))};
  const bool is_size = (!config.width || std::cmp_equal(width, config.width)) &&
                       (!config.height || std::cmp_equal(height, config.height));
  const bool is_place = !config.width || (std::cmp_equal(x, config.offset_x) && std::cmp_equal(y, config.offset_y));
  if (!is_size || !is_place)
    return Error{
        ErrorCode::Invalid,
        fmt::format("width, height, offset_x, offset_y: the camera makes {} x {} at {}, {} of {} x {} at {}, {}", width,
                    height, x, y, config.width, config.height, config.offset_x, config.offset_y)};
  return {};
}

}  // namespace

Error take_error(std::string_view attempted, GError* error) {
  bool is_final = false;
  if (error->domain == ARV_DEVICE_ERROR) switch (error->code) {
      case ARV_DEVICE_ERROR_WRONG_FEATURE:
      case ARV_DEVICE_ERROR_FEATURE_NOT_FOUND:
      case ARV_DEVICE_ERROR_INVALID_PARAMETER:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_NOT_IMPLEMENTED:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_INVALID_PARAMETER:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_WRITE_PROTECT:
        is_final = true;
        break;
      default:
        break;
    }
  // The camera's description rejects a value (out of range, no such entry). These errors have the domain of ArvGc.
  if (const char* domain = g_quark_to_string(error->domain); domain && std::string_view(domain) == "arv-gc-error-quark")
    is_final = true;
  Error made{is_final ? ErrorCode::Invalid : ErrorCode::Unavailable,
             fmt::format("camera: {}: {}", attempted, error->message)};
  g_error_free(error);
  return made;
}

Result<GRef<ArvCamera>> connect_camera(const AravisSource::Config& config, const OnControl& on_control) {
  auto camera = [&] {
    if (!config.address.empty() && !config.interface.empty())
      return connect_at(config.interface, config.address, on_control);
    const LookOn only(kGigeVision);
    if (!config.address.empty()) return connect_by_name(config.address, on_control);
    if (!config.id.empty()) return connect_by_name(config.id, on_control);
    return connect_by_serial(config.serial, on_control);
  }();
  if (!camera) return camera;
  if (!config.serial.empty()) {
    GError* error = nullptr;
    const char* serial = arv_camera_get_device_serial_number(camera->get(), &error);
    if (error) return take_error("read the serial number", error);
    if (!serial || config.serial != serial)
      return Error{ErrorCode::Invalid, fmt::format("serial: the rig names {}, but camera {} answers", config.serial,
                                                   serial ? serial : "?")};
  }
  if (arv_camera_is_gv_device(camera->get()) &&
      !arv_gv_device_is_controller(ARV_GV_DEVICE(arv_camera_get_device(camera->get()))))
    return Error{ErrorCode::Unavailable, "camera: another program controls it"};
  return camera;
}

std::string usb3_serial_of(const std::string& id) {
  const LookOn only(kUsb3Vision);
  arv_update_device_list();
  const auto text = [](const char* one) { return std::string(one ? one : ""); };
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    const std::string serial = text(arv_get_device_serial_nbr(i));
    const std::string by_model =
        fmt::format("{}-{}-{}", text(arv_get_device_vendor(i)), text(arv_get_device_model(i)), serial);
    if (id == text(arv_get_device_id(i)) || id == text(arv_get_device_physical_id(i)) || id == by_model) return serial;
  }
  return {};
}

sockaddr_in ipv4_of(GSocketAddress* address) {
  sockaddr_in out{};
  if (!address || !g_socket_address_to_native(address, &out, sizeof(out), nullptr) || out.sin_family != AF_INET)
    return {};
  return out;
}

Status configure_camera(ArvCamera* camera, const AravisSource::Config& config) {
  Steps steps;
  // This check is off by default in Aravis. With it, a value outside the camera's range is refused by name instead of
  // sent.
  arv_camera_set_range_check_policy(camera, ARV_RANGE_CHECK_POLICY_ENABLE);
  // A program that died may have left the camera running. An error is ignored, because the camera may not have been
  // running.
  arv_camera_stop_acquisition(camera, nullptr);
  steps("continuous acquisition",
        [&](GError** e) { arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, e); });
  steps("pixel_format", [&](GError** e) { arv_camera_set_pixel_format(camera, pfnc_code(config.pixel_format), e); });
  if (config.width && config.height)
    steps("width, height, offset_x, offset_y", [&](GError** e) {
      arv_camera_set_region(camera, static_cast<gint>(config.offset_x), static_cast<gint>(config.offset_y),
                            static_cast<gint>(config.width), static_cast<gint>(config.height), e);
    });
  configure_light(camera, config, steps);
  configure_trigger(camera, config, steps);
  configure_transport(camera, config, steps);
  configure_chunks(camera, config, steps);
  if (!config.features.empty())
    steps("features", [&](GError** e) {
      arv_device_set_features_from_string(arv_camera_get_device(camera), config.features.c_str(), e);
    });
  if (!steps.status()) return steps.status();
  return check_settings(camera, config);
}

}  // namespace hueline::drivers
