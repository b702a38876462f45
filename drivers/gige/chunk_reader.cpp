#include "drivers/gige/chunk_reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/portable_math.hpp"
#include "drivers/gige/chunk_data.hpp"
#include "drivers/gige/memory_device.hpp"

namespace hueline::drivers {
namespace {

constexpr const char* kExposure = "ChunkExposureTime";
constexpr const char* kGain = "ChunkGain";
constexpr double kMostGain_dB = 120;

/// The memory of a camera with the chunks of one image in it.
class MemoryWithChunks final : public CameraMemory {
 public:
  MemoryWithChunks(ArvDevice* camera, std::vector<std::uint32_t> ids) : camera_(camera), ids_(std::move(ids)) {}

  void show(std::vector<Chunk> chunks) { chunks_ = std::move(chunks); }

  Status read(std::uint64_t address, std::span<std::byte> out) override {
    if (address < ChunkDescription::kFirst) {
      GError* error = nullptr;
      arv_device_read_memory(camera_, address, static_cast<guint32>(out.size()), out.data(), &error);
      if (error) return take_error("read a register", error);
      return {};
    }
    const std::uint64_t number = (address - ChunkDescription::kFirst) / ChunkDescription::kApart,
                        at = (address - ChunkDescription::kFirst) % ChunkDescription::kApart;
    const auto chunk =
        std::ranges::find_if(chunks_, [&](const Chunk& one) { return number < ids_.size() && one.id == ids_[number]; });
    if (chunk == chunks_.end() || at > chunk->data.size() || out.size() > chunk->data.size() - at)
      return Error{ErrorCode::Unavailable, "the image does not have this chunk"};
    std::ranges::copy(chunk->data.subspan(at, out.size()), out.begin());
    return {};
  }
  Status write(std::uint64_t, std::span<const std::byte>) override {
    return Error{ErrorCode::Unsupported, "chunks are not written"};
  }

 private:
  ArvDevice* const camera_;
  const std::vector<std::uint32_t> ids_;
  std::vector<Chunk> chunks_;
};

/// Returns the length of the unit in which a feature is, us; SFNC has microseconds.
double us_of_unit(std::string_view unit) {
  if (unit == "s") return 1e6;
  if (unit == "ms") return 1e3;
  if (unit == "ns") return 1e-3;
  return 1;
}

}  // namespace

struct ChunkReader::Inside {
  Inside(ArvDevice* camera, std::vector<std::uint32_t> ids) : memory(camera, std::move(ids)) {}
  /// Returns the value of a feature of the image that `memory` shows.
  std::optional<double> value(ArvGcNode* node) const {
    if (!node) return std::nullopt;
    GError* error = nullptr;
    const double value = arv_gc_float_get_value(ARV_GC_FLOAT(node), &error);
    if (error) {
      g_error_free(error);
      return std::nullopt;
    }
    return std::isfinite(value) ? std::optional(value) : std::nullopt;
  }
  std::endian order = std::endian::big;
  MemoryWithChunks memory;
  GRef<ArvDevice> device;
  ArvGcNode *exposure = nullptr, *gain = nullptr;  // of `device`
  double us = 1;                                   // unit of the exposure
};

ChunkReader::ChunkReader(std::unique_ptr<Inside> inside) : inside_(std::move(inside)) {}
ChunkReader::~ChunkReader() = default;

std::unique_ptr<ChunkReader> ChunkReader::make(ArvCamera* camera, std::endian order) {
  ArvDevice* const device = arv_camera_get_device(camera);
  std::size_t size = 0;
  const char* xml = arv_device_get_genicam_xml(device, &size);
  ChunkDescription description = describe_chunks(xml ? std::string(xml, size) : std::string());
  if (description.ids.empty()) return nullptr;
  auto inside = std::make_unique<Inside>(device, std::move(description.ids));
  inside->order = order;
  auto made = make_memory_device(inside->memory, std::move(description.text));
  if (!made) return nullptr;
  inside->device = std::move(*made);
  const auto number = [&](const char* name) {
    ArvGcNode* node = arv_device_get_feature(inside->device.get(), name);
    return node && ARV_IS_GC_FLOAT(node) ? node : nullptr;
  };
  inside->exposure = number(kExposure);
  inside->gain = number(kGain);
  if (!inside->exposure) return nullptr;
  if (const char* unit = arv_gc_float_get_unit(ARV_GC_FLOAT(inside->exposure))) inside->us = us_of_unit(unit);
  return std::unique_ptr<ChunkReader>(new ChunkReader(std::move(inside)));
}

void ChunkReader::read(std::span<const std::byte> payload, ImageHeader& header) {
  inside_->memory.show(read_chunks(payload, inside_->order));
  if (const auto exposure = inside_->value(inside_->exposure)) {
    const double ns = *exposure * inside_->us * 1e3;
    if (ns >= 1 && ns <= static_cast<double>(kLongestReported.count())) header.exposure = nanoseconds(std::llround(ns));
  }
  // The standard's gain is in dB.
  if (const auto dB = inside_->value(inside_->gain); dB && std::abs(*dB) <= kMostGain_dB)
    header.gain = static_cast<float>(portable::pow(10.0, *dB / 20));
  inside_->memory.show({});
}

}  // namespace hueline::drivers
