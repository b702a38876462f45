#include "drivers/v4l2/v4l2_config.hpp"

#include "drivers/v4l2/v4l2_pixels.hpp"

namespace hueline::drivers {

void V4l2Config::visit(Keys& keys) {
  keys.text({"device", "",
             "The camera's device file. /dev/v4l/by-id and /dev/v4l/by-path have names that stay when the camera is "
             "plugged in again; /dev/video0 need not. At least one of `device`, `bus_info` and `serial` names the "
             "camera, and all that are given must fit.",
             "none"},
            device);
  keys.text({"bus_info", "", "The place of the camera as its driver names it (`v4l2-ctl --list-devices`).", "none"},
            bus_info);
  keys.text({"serial", "", "The serial number of a USB camera.", "none"}, serial);
  keys.whole(required("width", "px", "The width of the image."), width, {1, 65535});
  keys.whole(required("height", "px", "The height of the image."), height, {1, 65535});
  std::vector<std::string> words;
  std::optional<std::size_t> chosen;
  for (const V4l2Format& format : v4l2_formats()) {
    if (format.fourcc == fourcc) chosen = words.size();
    words.push_back(fourcc_text(format.fourcc));
  }
  if (keys.choice(required("format", "",
                           "The pixel format that the camera sends, by its four characters "
                           "(`v4l2-ctl --list-formats-ext`)."),
                  chosen, words))
    fourcc = v4l2_formats()[*chosen].fourcc;
  keys.number({"frame_rate_hz", "Hz", "The images a second.", "0: camera's own"}, frame_rate_hz, {0, 1000});
  keys.duration({"exposure_us", "us",
                 "The exposure; automatic exposure is turned off. A camera without the control "
                 "`exposure_time_absolute` has to be set to it by its own control in `controls`. Half of it is added "
                 "to the time of the exposure's start.",
                 "camera's own"},
                exposure, {1, 1'000'000});
  keys.list({"controls", "", "The camera's controls, which are set in this order, before the first image.", "none"},
            controls);
  // The kernel has 32 buffers at most.
  keys.whole({"stream_buffers", "images", "How many buffers the driver always has to fill."}, stream_buffers, {2, 16});
  keys.whole({"images_in_flight", "images",
              "How many images the recorder and the pipeline may hold in the driver's buffers, of which the kernel "
              "allows 32, and how many more in copies."},
             images_in_flight, {1, 1000});
  keys.flag({"zero_copy", "",
             "Whether images stay in the driver's buffers until recorder and pipeline are done with them. Images for "
             "which the driver has no buffers to spare are copied. Set it to false if these buffers are slow to read, "
             "as memory is that no cache holds."},
            zero_copy);
}

KeyError V4l2Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (device.empty() && bus_info.empty() && serial.empty())
    return {"device", "is missing; allowed: at least one of device, bus_info and serial"};
  return {};
}

}  // namespace hueline::drivers
