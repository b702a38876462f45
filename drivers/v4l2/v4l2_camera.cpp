#include "drivers/v4l2/v4l2_camera.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include "core/printable.hpp"
#include "drivers/v4l2/v4l2_ioctl.hpp"
#include "drivers/v4l2/v4l2_pixels.hpp"

namespace hueline::drivers {
namespace {

namespace fs = std::filesystem;

template <std::size_t N>
std::string text_of(const std::uint8_t (&chars)[N]) {
  return printable(std::string(chars, std::find(chars, chars + N, 0)));
}

FileDescriptor open_device(const std::string& path) {
  return FileDescriptor(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
}

/// Returns what kinds of streams the device node has (V4L2_CAP_*), 0 if it is no V4L2 device.
std::uint32_t query(int fd, V4l2Candidate& out) {
  v4l2_capability capability{};
  if (v4l2_ioctl(fd, VIDIOC_QUERYCAP, &capability) != 0) return 0;
  out.card = text_of(capability.card);
  out.bus_info = text_of(capability.bus_info);
  return (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
}

bool captures(std::uint32_t capabilities) {
  return (capabilities & V4L2_CAP_STREAMING) != 0 &&
         (capabilities & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) != 0;
}

std::string serial_of_node(const fs::path& node) {
  std::error_code problem;
  const fs::path folder = fs::canonical("/sys/class/video4linux" / node.filename() / "device", problem);
  return problem ? std::string() : usb_serial_of(folder);
}

std::string list_text(const std::vector<std::string>& items) {
  return items.empty() ? "none" : fmt::format("{}", fmt::join(items, ", "));
}

std::vector<std::string> existing_formats(const V4l2Camera& camera) {
  std::vector<std::string> texts;
  v4l2_fmtdesc format{};
  format.type = camera.buffer_type;
  for (; format.index < 256 && v4l2_ioctl(camera.fd.get(), VIDIOC_ENUM_FMT, &format) == 0; ++format.index)
    texts.push_back(fourcc_text(format.pixelformat) +
                    (find_v4l2_format(format.pixelformat) ? "" : " (which is not read)"));
  return texts;
}

std::vector<std::string> existing_sizes(const V4l2Camera& camera, std::uint32_t fourcc) {
  std::vector<std::string> texts;
  v4l2_frmsizeenum size{};
  size.pixel_format = fourcc;
  for (; size.index < 256 && v4l2_ioctl(camera.fd.get(), VIDIOC_ENUM_FRAMESIZES, &size) == 0; ++size.index) {
    if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      texts.push_back(fmt::format("{} x {}", size.discrete.width, size.discrete.height));
      continue;
    }
    const v4l2_frmsize_stepwise& range = size.stepwise;
    texts.push_back(fmt::format("{} to {} by {} x {} to {} by {}", range.min_width, range.max_width, range.step_width,
                                range.min_height, range.max_height, range.step_height));
    break;
  }
  return texts;
}

double rate_of(const v4l2_fract& interval) {
  return interval.numerator == 0 ? 0 : static_cast<double>(interval.denominator) / interval.numerator;
}

std::vector<std::string> existing_rates(const V4l2Camera& camera) {
  std::vector<std::string> texts;
  v4l2_frmivalenum interval{};
  interval.pixel_format = camera.header.fourcc;
  interval.width = camera.header.width;
  interval.height = camera.header.height;
  for (; interval.index < 256 && v4l2_ioctl(camera.fd.get(), VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0;
       ++interval.index) {
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      texts.push_back(fmt::format("{:g}", rate_of(interval.discrete)));
      continue;
    }
    texts.push_back(fmt::format("{:g} to {:g}", rate_of(interval.stepwise.max), rate_of(interval.stepwise.min)));
    break;
  }
  return texts;
}

Error refusal(int why, const std::string& attempted) {
  Error error = io_error(attempted, why);
  if (why == EBUSY || why == ENODEV || why == ENXIO) error.code = ErrorCode::Unavailable;
  if (why == EBUSY) error.message += ": another program uses it";
  return error;
}

Status set_format(V4l2Camera& camera, const V4l2Config& config) {
  v4l2_format format{};
  format.type = camera.buffer_type;
  // The members of the two kinds of formats have the same names, but not the same places.
  const auto fill = [&](auto& pixels) {
    pixels.width = config.width;
    pixels.height = config.height;
    pixels.pixelformat = config.fourcc;
    pixels.field = V4L2_FIELD_NONE;
  };
  camera.is_multiplanar() ? fill(format.fmt.pix_mp) : fill(format.fmt.pix);
  if (camera.is_multiplanar()) format.fmt.pix_mp.num_planes = 1;
  const std::string wanted =
      fmt::format("set {} to {} x {} {}", camera.path, config.width, config.height, fourcc_text(config.fourcc));
  if (v4l2_ioctl(camera.fd.get(), VIDIOC_S_FMT, &format) != 0) {
    Error error = refusal(errno, wanted);
    if (error.code == ErrorCode::Io)
      error = {ErrorCode::Invalid,
               fmt::format("{}; it has the formats {}", error.message, list_text(existing_formats(camera)))};
    return error;
  }
  std::uint32_t field = 0, planes = 1;
  V4l2Header& header = camera.header;
  const auto take = [&](const auto& pixels) {
    header.width = pixels.width;
    header.height = pixels.height;
    header.fourcc = pixels.pixelformat;
    header.colour_space = pixels.colorspace;
    header.ycbcr_encoding = pixels.ycbcr_enc;
    header.quantisation = pixels.quantization;
    field = pixels.field;
  };
  if (camera.is_multiplanar()) {
    take(format.fmt.pix_mp);
    planes = format.fmt.pix_mp.num_planes;
    header.stride = format.fmt.pix_mp.plane_fmt[0].bytesperline;
    camera.image_bytes = format.fmt.pix_mp.plane_fmt[0].sizeimage;
  } else {
    take(format.fmt.pix);
    header.stride = format.fmt.pix.bytesperline;
    camera.image_bytes = format.fmt.pix.sizeimage;
  }
  const auto refuse = [&](std::string why) {
    return Error{ErrorCode::Invalid, fmt::format("cannot {}: {}", wanted, why)};
  };
  if (header.fourcc != config.fourcc)
    return refuse(fmt::format("the camera takes {} instead; it has the formats {}", fourcc_text(header.fourcc),
                              list_text(existing_formats(camera))));
  if (header.width != config.width || header.height != config.height)
    return refuse(fmt::format("the camera takes {} x {} instead; it has the sizes {}", header.width, header.height,
                              list_text(existing_sizes(camera, config.fourcc))));
  if (field != V4L2_FIELD_NONE) return refuse("the camera sends interlaced images, which are not read");
  if (planes != 1) return refuse("the camera sends an image in several pieces of memory, which is not read");
  return {};
}

Status set_rate(V4l2Camera& camera, double rate_hz) {
  if (rate_hz == 0) return {};
  v4l2_streamparm parameters{};
  parameters.type = camera.buffer_type;
  const std::string wanted = fmt::format("set {} to {:g} images a second", camera.path, rate_hz);
  constexpr double kUnits = 1000;  // 29.97 Hz is 1000/29970
  parameters.parm.capture.timeperframe = {static_cast<std::uint32_t>(kUnits),
                                          static_cast<std::uint32_t>(std::lround(rate_hz * kUnits))};
  if (v4l2_ioctl(camera.fd.get(), VIDIOC_S_PARM, &parameters) != 0) {
    Error error = refusal(errno, wanted);
    if (errno == ENOTTY)
      error.message = fmt::format("cannot {}: its driver has no rate; leave frame_rate_hz out", wanted);
    if (error.code == ErrorCode::Io) error.code = ErrorCode::Invalid;
    return error;
  }
  const double taken = rate_of(parameters.parm.capture.timeperframe);
  if (std::abs(taken - rate_hz) > 0.005 * rate_hz)
    return Error{ErrorCode::Invalid, fmt::format("cannot {}: the camera takes {:g} instead; at this size it has {}",
                                                 wanted, taken, list_text(existing_rates(camera)))};
  return {};
}

/// Returns the path of the camera. Errors: Unavailable, with the cameras that exist.
Result<std::string> find_camera(const V4l2Config& config) {
  if (!config.device.empty()) return config.device;
  std::vector<std::string> others;
  for (const V4l2Candidate& candidate : list_v4l2_cameras()) {
    if ((config.bus_info.empty() || candidate.bus_info == config.bus_info) &&
        (config.serial.empty() || candidate.serial == config.serial))
      return candidate.path;
    others.push_back(candidate.text());
  }
  return Error{
      ErrorCode::Unavailable,
      fmt::format("there is no camera{}{}; there are: {}", config.bus_info.empty() ? "" : " at " + config.bus_info,
                  config.serial.empty() ? "" : " with serial " + config.serial, list_text(others))};
}

}  // namespace

std::string V4l2Candidate::text() const {
  return fmt::format("{} ({}, {}{})", path, card, bus_info, serial.empty() ? "" : ", serial " + serial);
}

std::string usb_serial_of(const std::string& device_folder) {
  // The video device belongs to an interface, whose parent is the USB device.
  std::ifstream file(fs::path(device_folder).parent_path() / "serial");
  std::string serial;
  std::getline(file, serial);
  return printable(serial);
}

std::vector<V4l2Candidate> list_v4l2_cameras() {
  std::vector<std::pair<int, V4l2Candidate>> found;
  std::error_code problem;
  for (const auto& entry : fs::directory_iterator("/dev", problem)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with("video") || name.size() == 5 || name.find_first_not_of("0123456789", 5) != name.npos)
      continue;
    V4l2Candidate candidate;
    candidate.path = entry.path();
    const FileDescriptor fd = open_device(candidate.path);
    if (!fd || !captures(query(fd.get(), candidate))) continue;
    candidate.serial = serial_of_node(entry.path());
    found.emplace_back(std::atoi(name.c_str() + 5), std::move(candidate));
  }
  std::ranges::sort(found, {}, [](const auto& one) { return one.first; });
  std::vector<V4l2Candidate> out;
  for (auto& one : found) out.push_back(std::move(one.second));
  return out;
}

Result<V4l2Camera> open_v4l2_camera(const V4l2Config& config) {
  const auto path = find_camera(config);
  if (!path) return path.error();
  V4l2Camera camera;
  camera.path = *path;
  camera.fd = open_device(camera.path);
  if (!camera.fd) {
    Error error = io_error("open " + camera.path, errno);
    error.code = ErrorCode::Unavailable;  // also EACCES: the rights come a moment after the device
    if (errno == EACCES) error.message += ": is the user in the group video?";
    return error;
  }
  V4l2Candidate candidate;
  const std::uint32_t capabilities = query(camera.fd.get(), candidate);
  if (!captures(capabilities))
    return Error{ErrorCode::Invalid,
                 fmt::format("{} is no device that streams images (a camera has several device files)", camera.path)};
  candidate.path = camera.path;
  std::error_code problem;
  const fs::path node = fs::canonical(camera.path, problem);
  candidate.serial = problem ? std::string() : serial_of_node(node);
  if ((!config.bus_info.empty() && config.bus_info != candidate.bus_info) ||
      (!config.serial.empty() && config.serial != candidate.serial))
    return Error{ErrorCode::Unavailable, fmt::format("{} is another camera than the rig names", candidate.text())};
  camera.buffer_type =
      (capabilities & V4L2_CAP_VIDEO_CAPTURE) != 0 ? V4L2_BUF_TYPE_VIDEO_CAPTURE : V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
  if (Status status = set_format(camera, config); !status) return status.error();
  if (Status status = set_rate(camera, config.frame_rate_hz); !status) return status.error();
  const auto controls = list_v4l2_controls(camera.fd.get());
  const auto settings = with_exposure(controls, config.exposure, config.controls);
  if (!settings) return settings.error();
  if (Status status = set_v4l2_controls(camera.fd.get(), controls, *settings); !status) {
    Error error = status.error();
    error.message = camera.path + ": " + error.message;
    return error;
  }
  return camera;
}

}  // namespace hueline::drivers
