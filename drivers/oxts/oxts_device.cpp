#include "drivers/oxts/oxts_device.hpp"

#include <string_view>

#include "drivers/oxts/ncom_form.hpp"
#include "drivers/oxts/oxts_decoder.hpp"
#include "drivers/stream/recognise.hpp"
#include "drivers/stream/stream_device.hpp"

namespace hueline::drivers {
namespace {

constexpr char kName[] = "OxTS, NCOM";

struct OxtsTraits {
  static constexpr const char* kLog = "A file of NCOM packets.";
  static constexpr bool kHasDatagrams = true;
  using Logs = void;
};

bool is_oxts_log(std::string_view first_bytes) { return has_message<NcomForm>(first_bytes); }

}  // namespace

constinit const DeviceType kOxts{
    .word = "oxts",
    .role = Role::Pos,
    .is_sheddable = false,
    .make = make_device<StreamDevice<OxtsDecoder, OxtsTraits>>,
    .files = {.log = {.format = "OxTS NCOM", .ending = ".ncom", .is_beginning = is_oxts_log},
              .capture = {.kind = "an OxTS",
                          .has_signature = true,
                          .listen = listen_to_stream<NcomForm, OxtsDecoder, kName>}},
    .solutions = "an NCOM packet of the navigation, with the GPS time of its status channels"};

}  // namespace hueline::drivers
