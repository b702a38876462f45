#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/keys.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

/// The controls of a V4L2 device (brightness, exposure, gain, ...), by their names.
namespace hueline::drivers {

/// A control that the rig sets.
struct V4l2Setting {
  std::string name;   ///< as v4l2-ctl writes it: small letters, digits and underscores
  std::string value;  ///< a whole number, true or false, or the words of a menu's item

  void visit(Keys& keys);
};

/// What a device says of one of its controls.
struct V4l2Control {
  enum class Kind : std::uint8_t { Number, Truth, Menu, Bits, Button, Other };

  std::uint32_t id = 0;
  std::string name;
  Kind kind = Kind::Number;
  std::int64_t min = 0, max = 0, step = 1;
  std::vector<std::pair<std::int64_t, std::string>> items{};  ///< of a menu: number and words
  bool is_read_only = false;
  bool is_write_only = false;
  bool is_volatile = false;  ///< the device changes it by itself
  bool is_wide = false;      ///< 64 bits

  /// Describes the control for messages: "gain: 0 to 255", "power_line_frequency: 0 (Disabled), 1 (50 Hz)".
  std::string text() const;
};

/// Returns the name of a control or an item as it is used in rigs: "Exposure Time, Absolute" is exposure_time_absolute.
std::string v4l2_control_name(std::string_view title);

/// Returns the number that `value` stands for. Errors: Invalid, with what is allowed, if the control cannot take it.
Result<std::int64_t> v4l2_control_value(const V4l2Control& control, std::string_view value);

/// Returns the control with this name. Errors: Invalid, with all controls that exist.
Result<const V4l2Control*> find_v4l2_control(const std::vector<V4l2Control>& controls, std::string_view name);

/// Returns `settings`, and before them those that set `exposure`. Errors: Invalid, if the camera has no control for it
/// and `settings` have none whose name begins with "exposure".
Result<std::vector<V4l2Setting>> with_exposure(const std::vector<V4l2Control>& controls,
                                               std::optional<nanoseconds> exposure,
                                               const std::vector<V4l2Setting>& settings);

/// Asks the device for its controls.
std::vector<V4l2Control> list_v4l2_controls(int fd);

/// Sets the controls in their order and reads each back. Errors: Invalid if the device has no such control or does not
/// take its value; Unavailable if another program holds it.
Status set_v4l2_controls(int fd, const std::vector<V4l2Control>& controls, const std::vector<V4l2Setting>& settings);

}  // namespace hueline::drivers
