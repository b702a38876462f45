#include "drivers/applanix/applanix_device.hpp"

#include <string_view>

#include "drivers/applanix/applanix_decoder.hpp"
#include "drivers/applanix/applanix_form.hpp"
#include "drivers/stream/recognise.hpp"
#include "drivers/stream/stream_device.hpp"

namespace hueline::drivers {
namespace {

constexpr char kName[] = "Applanix POS";

struct ApplanixTraits {
  static constexpr const char* kLog = "A file of the POS (groups as logged).";
  static constexpr bool kHasDatagrams = true;
  using Logs = void;
};

bool is_applanix_log(std::string_view first_bytes) { return has_message<ApplanixForm>(first_bytes); }

}  // namespace

constinit const DeviceType kApplanix{
    .word = "applanix",
    .role = Role::Pos,
    .is_sheddable = false,
    .make = make_device<StreamDevice<ApplanixDecoder, ApplanixTraits>>,
    .files = {.log = {.format = "Applanix POS groups", .ending = ".pos", .is_beginning = is_applanix_log},
              .capture = {.kind = "an Applanix POS",
                          .has_signature = true,
                          .listen = listen_to_stream<ApplanixForm, ApplanixDecoder, kName>}},
    .solutions = "group 1"};

}  // namespace hueline::drivers
