#include "drivers/gige/memory_device.hpp"

#include <array>
#include <cstddef>
#include <span>
#include <utility>

#include "drivers/little_endian.hpp"

namespace {

using hueline::ErrorCode;
using hueline::Status;
using hueline::drivers::CameraMemory;
using hueline::drivers::get_little;
using hueline::drivers::put_little;

/// What an object of the type below holds.
struct Inside {
  CameraMemory* memory = nullptr;
  std::string description;
  ArvGc* features = nullptr;
};

struct MemoryDevice {
  ArvDevice parent;
  Inside* inside;
};
struct MemoryDeviceClass {
  ArvDeviceClass parent;
};

Inside& inside(gpointer device) { return *static_cast<MemoryDevice*>(device)->inside; }

/// Tells Aravis's caller of an error; take_error() makes an Error of it again.
gboolean tell(const Status& status, GError** error) {
  if (status) return TRUE;
  const auto code = [&] {
    switch (status.error().code) {
      case ErrorCode::Unsupported:
        return ARV_DEVICE_ERROR_PROTOCOL_ERROR_NOT_IMPLEMENTED;
      case ErrorCode::Invalid:
        return ARV_DEVICE_ERROR_PROTOCOL_ERROR_INVALID_PARAMETER;
      case ErrorCode::Disconnected:
        return ARV_DEVICE_ERROR_NOT_CONNECTED;
      case ErrorCode::TimedOut:
        return ARV_DEVICE_ERROR_TIMEOUT;
      default:
        return ARV_DEVICE_ERROR_TRANSFER_ERROR;
    }
  }();
  g_set_error_literal(error, ARV_DEVICE_ERROR, code, status.error().message.c_str());
  return FALSE;
}

gboolean read_memory(ArvDevice* device, guint64 address, guint32 size, void* buffer, GError** error) {
  return tell(inside(device).memory->read(address, std::span(static_cast<std::byte*>(buffer), size)), error);
}
gboolean write_memory(ArvDevice* device, guint64 address, guint32 size, void* buffer, GError** error) {
  return tell(inside(device).memory->write(address, std::span(static_cast<const std::byte*>(buffer), size)), error);
}
gboolean read_register(ArvDevice* device, guint64 address, guint32* value, GError** error) {
  std::array<std::byte, 4> bytes{};
  const Status read = inside(device).memory->read(address, bytes);
  *value = get_little<guint32>(bytes, 0);
  return tell(read, error);
}
gboolean write_register(ArvDevice* device, guint64 address, guint32 value, GError** error) {
  std::array<std::byte, 4> bytes{};
  put_little(bytes, 0, value);
  return tell(inside(device).memory->write(address, bytes), error);
}
const char* get_genicam_xml(ArvDevice* device, std::size_t* size) {
  if (size) *size = inside(device).description.size();
  return inside(device).description.c_str();
}
ArvGc* get_genicam(ArvDevice* device) { return inside(device).features; }
ArvStream* create_stream(ArvDevice*, ArvStreamCallback, void*, GDestroyNotify, GError** error) {
  g_set_error_literal(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NO_STREAM_CHANNEL, "Aravis does not read this stream");
  return nullptr;
}

GObjectClass* parent_class = nullptr;

void finalize(GObject* object) {
  Inside* const held = std::exchange(reinterpret_cast<MemoryDevice*>(object)->inside, nullptr);
  if (held->features) g_object_unref(held->features);
  delete held;
  parent_class->finalize(object);
}

void init_class(gpointer made, gpointer) {
  parent_class = static_cast<GObjectClass*>(g_type_class_peek_parent(made));
  static_cast<GObjectClass*>(made)->finalize = finalize;
  auto* const device = static_cast<ArvDeviceClass*>(made);
  device->create_stream = create_stream;
  device->get_genicam_xml = get_genicam_xml;
  device->get_genicam = get_genicam;
  device->read_memory = read_memory;
  device->write_memory = write_memory;
  device->read_register = read_register;
  device->write_register = write_register;
}

void init_object(GTypeInstance* object, gpointer) { reinterpret_cast<MemoryDevice*>(object)->inside = new Inside; }

GType type() {
  static const GType made =
      g_type_register_static_simple(ARV_TYPE_DEVICE, "HuelineMemoryDevice", sizeof(MemoryDeviceClass), init_class,
                                    sizeof(MemoryDevice), init_object, GTypeFlags{});
  return made;
}

}  // namespace

namespace hueline::drivers {

Result<GRef<ArvDevice>> make_memory_device(CameraMemory& memory, std::string description) {
  GRef<ArvDevice> device(static_cast<ArvDevice*>(g_object_new(type(), nullptr)));
  Inside& made = inside(device.get());
  made.memory = &memory;
  made.description = std::move(description);
  made.features = arv_gc_new(device.get(), made.description.data(), made.description.size());
  if (!made.features) return Error{ErrorCode::Malformed, "camera: its description file is not GenApi XML"};
  return device;
}

}  // namespace hueline::drivers
