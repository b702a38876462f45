#include "sim/devices/camera_registers.hpp"

#include <arv.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <functional>
#include <optional>

#include "sim/devices/big_endian.hpp"

namespace hueline::sim {
namespace {

struct Unref {
  void operator()(ArvFakeCamera* camera) const { g_object_unref(camera); }
};
using CameraPtr = std::unique_ptr<ArvFakeCamera, Unref>;

// Bootstrap registers that are only filled in.
constexpr std::uint32_t kMacHigh = 0x008, kMacLow = 0x00C, kCurrentIp = 0x024, kGvcpCapability = 0x934;
constexpr std::uint32_t kCanWriteMemory = 1U << 1U, kCanResendPackets = 1U << 2U;
constexpr std::size_t kSerialBytes = 16;

std::optional<std::uint32_t> pixel_format_number(const std::string& name) {
  constexpr std::array<std::pair<const char*, std::uint32_t>, 5> kFormats{{{"BayerRG8", ARV_PIXEL_FORMAT_BAYER_RG_8},
                                                                           {"BayerBG8", ARV_PIXEL_FORMAT_BAYER_BG_8},
                                                                           {"BayerGR8", ARV_PIXEL_FORMAT_BAYER_GR_8},
                                                                           {"BayerGB8", ARV_PIXEL_FORMAT_BAYER_GB_8},
                                                                           {"Mono8", ARV_PIXEL_FORMAT_MONO_8}}};
  for (const auto& [format, number] : kFormats) {
    if (name == format) return number;
  }
  return {};
}

/// Aravis's own description of its fake camera plus the stream packet size with its test command (GenICam SFNC names).
std::string description(std::uint32_t max_packet_bytes) {
  const CameraPtr plain(arv_fake_camera_new("plain"));
  std::size_t size = 0;
  const char* text = arv_fake_camera_get_genicam_xml(plain.get(), &size);
  std::string xml = text != nullptr ? std::string(text, size) : std::string();
  const std::size_t end = xml.rfind("</RegisterDescription>");
  if (end == std::string::npos) return {};
  const auto bits = [](const char* name, int msb, int lsb) {
    return fmt::format(
        "<MaskedIntReg Name=\"{}\" NameSpace=\"Custom\"><Address>0xd04</Address><Length>4</Length><AccessMode>RW</AccessMode>"
        "<pPort>Device</pPort><Cachable>NoCache</Cachable><LSB>{}</LSB><MSB>{}</MSB><Sign>Unsigned</Sign>"
        "<Endianess>BigEndian</Endianess></MaskedIntReg>",
        name, lsb, msb);
  };
  // Bits are counted from the most significant one in big-endian registers.
  return xml.insert(end, fmt::format("<Integer Name=\"GevSCPSPacketSize\" NameSpace=\"Standard\">"
                                     "<pValue>StreamPacketSizeBits</pValue><Min>576</Min><Max>{}</Max><Inc>4</Inc></Integer>"
                                     "{}"
                                     "<Command Name=\"GevSCPSFireTestPacket\" NameSpace=\"Standard\">"
                                     "<pValue>StreamFireTestBit</pValue><CommandValue>1</CommandValue></Command>"
                                     "{}",
                                     max_packet_bytes, bits("StreamPacketSizeBits", 16, 31), bits("StreamFireTestBit", 0, 0)));
}

/// A file that lives while Aravis reads it.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text) {
    path_ = (std::filesystem::temp_directory_path() / "hueline-camera-XXXXXX").string();
    const int fd = ::mkstemp(path_.data());
    if (fd < 0) {
      errno_ = errno;
      return;
    }
    is_written_ = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    errno_ = is_written_ ? 0 : errno;
    ::close(fd);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  ~TemporaryFile() { ::unlink(path_.c_str()); }
  const std::string& path() const { return path_; }
  bool is_written() const { return is_written_; }
  int error_number() const { return errno_; }

 private:
  std::string path_;
  bool is_written_ = false;
  int errno_ = 0;
};

}  // namespace

struct CameraRegisters::Camera {
  CameraPtr camera;
  std::size_t memory_bytes = 0;  // registers and description
};

CameraRegisters::CameraRegisters() : camera_(std::make_unique<Camera>()) {}
CameraRegisters::~CameraRegisters() = default;

std::string CameraRegisters::Config::validate() const {
  if (serial.empty() || serial.size() >= kSerialBytes) return fmt::format("serial: '{}' must have 1 .. 15 characters", serial);
  if (width == 0 || height == 0 || width > 65535 || height > 65535) {
    return fmt::format("width, height: {} x {} is not within 1 .. 65535", width, height);
  }
  if (!pixel_format_number(pixel_format)) {
    return fmt::format("pixel_format: '{}' is none of BayerRG8, BayerBG8, BayerGR8, BayerGB8, Mono8", pixel_format);
  }
  if (max_packet_bytes < 576 || max_packet_bytes > 65000) {
    return fmt::format("max_packet_bytes: {} is not within 576 .. 65000", max_packet_bytes);
  }
  return {};
}

Result<std::unique_ptr<CameraRegisters>> CameraRegisters::create(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  const std::string xml = description(config.max_packet_bytes);
  if (xml.empty()) return Error{ErrorCode::Unsupported, "Aravis has no description of its fake camera"};
  const TemporaryFile file(xml);
  if (!file.is_written()) return io_error("write the camera's description to " + file.path(), file.error_number());

  auto registers = std::make_unique<CameraRegisters>();
  registers->camera_->camera.reset(arv_fake_camera_new_full(config.serial.c_str(), file.path().c_str()));
  std::size_t xml_bytes = 0;
  (void)arv_fake_camera_get_genicam_xml(registers->camera_->camera.get(), &xml_bytes);
  registers->camera_->memory_bytes = ARV_FAKE_CAMERA_MEMORY_SIZE + xml_bytes;

  registers->set(ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, config.width);
  registers->set(ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, config.height);
  registers->set(camera_register::kWidth, config.width);
  registers->set(camera_register::kHeight, config.height);
  registers->set(camera_register::kPixelFormat, *pixel_format_number(config.pixel_format));
  registers->set(kGvcpCapability, kCanWriteMemory | kCanResendPackets);
  registers->set(kCurrentIp, config.ipv4);
  // A locally administered MAC address; discovery tells cameras apart by it.
  registers->set(kMacHigh, 0x0000'0248);
  registers->set(kMacLow, static_cast<std::uint32_t>(std::hash<std::string>{}(config.serial)));
  return registers;
}

bool CameraRegisters::read(std::uint32_t address, std::span<std::byte> out) {
  if (out.empty() || address >= camera_->memory_bytes) return false;
  // Clients read the description in whole words; beyond its end there are zeros.
  return arv_fake_camera_read_memory(camera_->camera.get(), address, static_cast<guint32>(out.size()), out.data()) != FALSE;
}

bool CameraRegisters::write(std::uint32_t address, std::span<const std::byte> bytes) {
  if (bytes.empty() || address >= ARV_FAKE_CAMERA_MEMORY_SIZE || bytes.size() > ARV_FAKE_CAMERA_MEMORY_SIZE - address) {
    return false;
  }
  return arv_fake_camera_write_memory(camera_->camera.get(), address, static_cast<guint32>(bytes.size()), bytes.data()) !=
         FALSE;
}

std::uint32_t CameraRegisters::get(std::uint32_t address) {
  std::array<std::byte, 4> word{};
  return read(address, word) ? get_be32(word, 0) : 0;
}

void CameraRegisters::set(std::uint32_t address, std::uint32_t value) {
  Bytes word;
  put_be32(word, value);
  (void)write(address, word);
}

}  // namespace hueline::sim
