#include "drivers/septentrio/septentrio_device.hpp"

#include <string_view>

#include "drivers/septentrio/sbf_form.hpp"
#include "drivers/septentrio/septentrio_decoder.hpp"
#include "drivers/septentrio/septentrio_logs.hpp"
#include "drivers/stream/recognise.hpp"
#include "drivers/stream/stream_device.hpp"

namespace hueline::drivers {
namespace {

struct SeptentrioTraits {
  static constexpr const char* kLog = "A log of the receiver (SBF).";
  static constexpr bool kHasDatagrams = false;
  using Logs = SeptentrioLogs;
};

bool is_sbf_log(std::string_view first_bytes) { return has_message<SbfForm>(first_bytes); }

}  // namespace

constinit const DeviceType kSeptentrio{
    .word = "septentrio",
    .role = Role::Pos,
    .is_sheddable = false,
    .make = make_device<StreamDevice<SeptentrioDecoder, SeptentrioTraits>>,
    .files = {.log = {.format = "Septentrio SBF", .ending = ".sbf", .is_beginning = is_sbf_log}},
    .solutions = "INSNavGeod or INSNavCart"};

}  // namespace hueline::drivers
