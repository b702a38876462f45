#include "drivers/v4l2/v4l2_control.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>

#include "core/nearest_word.hpp"
#include "core/printable.hpp"
#include "drivers/v4l2/v4l2_ioctl.hpp"

namespace hueline::drivers {
namespace {

using Kind = V4l2Control::Kind;

Kind kind_of(std::uint32_t type) {
  switch (type) {
    case V4L2_CTRL_TYPE_INTEGER:
    case V4L2_CTRL_TYPE_INTEGER64:
      return Kind::Number;
    case V4L2_CTRL_TYPE_BOOLEAN:
      return Kind::Truth;
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
      return Kind::Menu;
    case V4L2_CTRL_TYPE_BITMASK:
      return Kind::Bits;
    case V4L2_CTRL_TYPE_BUTTON:
      return Kind::Button;
    default:
      return Kind::Other;
  }
}

std::string text_of(const void* chars, std::size_t size) {
  const auto* begin = static_cast<const char*>(chars);
  return printable(std::string_view(begin, std::find(begin, begin + size, '\0')));
}

template <class Item>
std::string joined(const std::vector<Item>& items, std::string_view between, auto text_of_item) {
  std::string text;
  for (const Item& item : items) text += (text.empty() ? std::string() : std::string(between)) + text_of_item(item);
  return text;
}

/// Reads or writes one control. Returns errno, or 0.
int access(int fd, unsigned long request, const V4l2Control& control, std::int64_t& value) {
  v4l2_ext_control one{};
  one.id = control.id;
  if (control.is_wide)
    one.value64 = value;
  else
    one.value = static_cast<std::int32_t>(value);  // a mask of bits may use the sign
  v4l2_ext_controls all{};
  all.which = V4L2_CTRL_WHICH_CUR_VAL;
  all.count = 1;
  all.controls = &one;
  if (v4l2_ioctl(fd, request, &all) != 0) return errno;
  value = control.is_wide              ? one.value64
          : control.kind == Kind::Bits ? static_cast<std::int64_t>(static_cast<std::uint32_t>(one.value))
                                       : one.value;
  return 0;
}

}  // namespace

void V4l2Setting::visit(Keys& keys) {
  keys.text(required("name", "", "The control's name as `v4l2-ctl --list-ctrls-menus` writes it."), name);
  keys.text(required("value", "", "A whole number, true or false, or the words of a menu's item."), value);
}

std::string v4l2_control_name(std::string_view title) {
  std::string name;
  for (const char c : title) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte))
      name += static_cast<char>(std::tolower(byte));
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

std::string V4l2Control::text() const {
  std::string range;
  switch (kind) {
    case Kind::Number:
      range = fmt::format("{} to {}", min, max);
      if (step > 1) range += fmt::format(" in steps of {}", step);
      break;
    case Kind::Truth:
      range = "false or true";
      break;
    case Kind::Menu:
      range = joined(items, ", ", [](const auto& item) { return fmt::format("{} ({})", item.first, item.second); });
      break;
    case Kind::Bits:
      range = fmt::format("bits of 0x{:x}", max);
      break;
    case Kind::Button:
      range = "a button, any value";
      break;
    case Kind::Other:
      range = "of a kind that cannot be set here";
      break;
  }
  return name + ": " + range + (is_read_only ? ", read only" : "");
}

Result<std::int64_t> v4l2_control_value(const V4l2Control& control, std::string_view value) {
  const auto refuse = [&](std::string_view why) {
    return Error{ErrorCode::Invalid,
                 fmt::format("control {} {}{}; allowed: {}", control.name, why, printable(value), control.text())};
  };
  if (control.is_read_only) return refuse("is read only, so it cannot be set to ");
  if (control.kind == Kind::Other) return refuse("cannot be set to ");
  if (control.kind == Kind::Button) return 0;
  if (control.kind == Kind::Truth && (value == "true" || value == "false")) return value == "true" ? 1 : 0;
  const bool is_hexadecimal = value.starts_with("0x");
  const std::string_view digits = is_hexadecimal ? value.substr(2) : value;
  std::int64_t number = 0;
  const auto [end, problem] =
      std::from_chars(digits.data(), digits.data() + digits.size(), number, is_hexadecimal ? 16 : 10);
  if (problem != std::errc() || end != digits.data() + digits.size()) {
    const auto item = std::ranges::find_if(
        control.items, [&](const auto& one) { return v4l2_control_name(one.second) == v4l2_control_name(value); });
    return item == control.items.end() ? Result<std::int64_t>(refuse("cannot be ")) : item->first;
  }
  bool is_allowed = number >= control.min && number <= control.max;
  if (control.kind == Kind::Number && is_allowed && control.step > 1)
    is_allowed = (static_cast<std::uint64_t>(number) - static_cast<std::uint64_t>(control.min)) %
                     static_cast<std::uint64_t>(control.step) ==
                 0;
  if (control.kind == Kind::Bits)
    is_allowed = number >= 0 && (static_cast<std::uint64_t>(number) & ~static_cast<std::uint64_t>(control.max)) == 0;
  if (control.kind == Kind::Menu)
    is_allowed = std::ranges::any_of(control.items, [&](const auto& item) { return item.first == number; });
  if (!is_allowed) return refuse("cannot be ");
  return number;
}

Result<const V4l2Control*> find_v4l2_control(const std::vector<V4l2Control>& controls, std::string_view name) {
  const auto found = std::ranges::find(controls, name, &V4l2Control::name);
  if (found != controls.end()) return &*found;
  std::vector<std::string> names;
  for (const V4l2Control& control : controls) names.push_back(control.name);
  const std::string all =
      controls.empty() ? "none" : joined(controls, "; ", [](const V4l2Control& control) { return control.text(); });
  const std::string meant = did_you_mean(name, names);
  return Error{ErrorCode::Invalid, fmt::format("the camera has no control {}{} It has: {}", printable(name),
                                               meant.empty() ? "." : meant, all)};
}

Result<std::vector<V4l2Setting>> with_exposure(const std::vector<V4l2Control>& controls,
                                               std::optional<nanoseconds> exposure,
                                               const std::vector<V4l2Setting>& settings) {
  if (!exposure) return settings;
  const auto has = [&](std::uint32_t id) { return std::ranges::find(controls, id, &V4l2Control::id); };
  const auto absolute = has(V4L2_CID_EXPOSURE_ABSOLUTE);
  if (absolute == controls.end()) {
    if (std::ranges::any_of(settings, [](const auto& setting) { return setting.name.starts_with("exposure"); }))
      return settings;
    const auto lines = has(V4L2_CID_EXPOSURE);
    return Error{ErrorCode::Invalid,
                 fmt::format("the camera has no control exposure_time_absolute, so exposure_us cannot set it; set its "
                             "own control in controls ({})",
                             lines == controls.end() ? "it has none named exposure" : lines->text())};
  }
  std::vector<V4l2Setting> out;
  if (const auto automatic = has(V4L2_CID_EXPOSURE_AUTO); automatic != controls.end())
    out.push_back({automatic->name, std::to_string(V4L2_EXPOSURE_MANUAL)});
  // The control counts in 100 us.
  out.push_back({absolute->name, std::to_string(std::llround(static_cast<double>(exposure->count()) / 1e5))});
  out.insert(out.end(), settings.begin(), settings.end());
  return out;
}

std::vector<V4l2Control> list_v4l2_controls(int fd) {
  std::vector<V4l2Control> controls;
  v4l2_query_ext_ctrl query{};
  constexpr std::uint32_t kNext = V4L2_CTRL_FLAG_NEXT_CTRL;
  for (query.id = kNext; v4l2_ioctl(fd, VIDIOC_QUERY_EXT_CTRL, &query) == 0; query.id |= kNext) {
    if (query.type == V4L2_CTRL_TYPE_CTRL_CLASS || (query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) continue;
    V4l2Control control;
    control.id = query.id;
    control.name = v4l2_control_name(text_of(query.name, sizeof query.name));
    control.kind = kind_of(query.type);
    control.is_wide = query.type == V4L2_CTRL_TYPE_INTEGER64;
    control.min = query.minimum;
    control.max = query.maximum;
    control.step = static_cast<std::int64_t>(query.step);
    control.is_read_only = (query.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0;
    control.is_write_only = (query.flags & V4L2_CTRL_FLAG_WRITE_ONLY) != 0;
    control.is_volatile = (query.flags & (V4L2_CTRL_FLAG_VOLATILE | V4L2_CTRL_FLAG_EXECUTE_ON_WRITE)) != 0;
    if (control.kind == Kind::Menu) {
      constexpr std::int64_t kMostItems = 256;  // a driver's table; bounds the loop whatever it says
      for (std::int64_t i = control.min; i <= control.max && i < control.min + kMostItems; ++i) {
        v4l2_querymenu item{};
        item.id = query.id;
        item.index = static_cast<std::uint32_t>(i);
        if (v4l2_ioctl(fd, VIDIOC_QUERYMENU, &item) != 0) continue;  // menus may have holes
        const bool is_number = query.type == V4L2_CTRL_TYPE_INTEGER_MENU;
        control.items.emplace_back(i, is_number ? std::to_string(item.value) : text_of(item.name, sizeof item.name));
      }
    }
    controls.push_back(std::move(control));
  }
  return controls;
}

Status set_v4l2_controls(int fd, const std::vector<V4l2Control>& controls, const std::vector<V4l2Setting>& settings) {
  for (const V4l2Setting& setting : settings) {
    const auto control = find_v4l2_control(controls, setting.name);
    if (!control) return control.error();
    const V4l2Control& at = **control;
    const auto wanted = v4l2_control_value(at, setting.value);
    if (!wanted) return wanted.error();
    std::int64_t value = *wanted;
    if (const int why = access(fd, VIDIOC_S_EXT_CTRLS, at, value); why != 0) {
      Error error = io_error(fmt::format("set control {} to {}", at.name, setting.value), why);
      if (why == EBUSY || why == ENODEV) {
        error.code = ErrorCode::Unavailable;
      } else {
        error.code = ErrorCode::Invalid;
        if (why == EACCES) error.message += ": an automatic control of the camera governs it; turn that off before";
      }
      return error;
    }
    if (at.is_write_only || at.is_volatile || at.kind == Kind::Button) continue;
    value = 0;
    if (const int why = access(fd, VIDIOC_G_EXT_CTRLS, at, value); why != 0)
      return io_error(fmt::format("read back control {}", at.name), why);
    if (value != *wanted)
      return Error{ErrorCode::Invalid, fmt::format("control {} was set to {}, but the camera keeps {}; allowed: {}",
                                                   at.name, *wanted, value, at.text())};
  }
  return {};
}

}  // namespace hueline::drivers
