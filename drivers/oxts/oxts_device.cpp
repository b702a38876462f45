#include "drivers/oxts/oxts_device.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
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

/// A packet that says something. 0xE7 in front of zeros passes all sums, and stands in many files that are no NCOM.
class FilledNcomForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t at, bool is_resync) override {
    const Judgement out = form_.judge(rest, at, is_resync);
    const auto is_zero = [](std::byte b) { return b == std::byte{0}; };
    return out.verdict == Judgement::Verdict::Whole &&
                   std::ranges::all_of(rest.subspan(1, NcomForm::kBytes - 1), is_zero)
               ? Judgement{}
               : out;
  }

 private:
  NcomForm form_;
};

bool is_oxts_log(std::string_view first_bytes) { return has_message<FilledNcomForm>(first_bytes); }

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
