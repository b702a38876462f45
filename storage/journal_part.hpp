#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "storage/journal_reader.hpp"

namespace hueline::storage {

/// Which packets of a recording go into another one.
struct JournalPart {
  double from_s = 0;           ///< s after the first packet of the recording, as in the health and the verdict
  std::optional<double> to_s;  ///< empty: to the end
  /// By SensorId, whether the sensor's packets are left out; may be shorter than the sensors. hueline's own are kept.
  std::vector<bool> left_out;
};

/// What was copied, and what was not.
struct CopiedPart {
  std::uint64_t packets = 0, bytes = 0;     ///< written, and bytes of their payloads
  std::uint64_t before = 0, of_others = 0;  ///< left out: before the time, and of sensors that are left out
  bool ends_early = false;                  ///< the recording was not read to its end, because `to_s` was reached
  std::uint64_t damages = 0;                ///< damaged chunks that were skipped, and segments that are missing
  std::string first_damage;                 ///< why; empty if nothing was damaged
  Status end;                               ///< ok, or how the recording ends if it does not end well
};

/// Copies packets of a recording into a new one, which is whole, whatever state the old one is in. Packets keep bytes,
/// times and marks. Their sequence begins at 0 and has the gaps of the old one, so packets that the capture lost stay
/// missing and those that are left out do not. The ledgers of the old one are left out if sequences change. The header
/// says where the new one is from.
///
/// Errors: of the new file, which is then as far as it came; Unsupported if there is nothing to write. The old file is
/// only read.
Result<CopiedPart> copy_part(JournalReader& journal, const std::string& name, const JournalPart& part,
                             const std::filesystem::path& to);

}  // namespace hueline::storage
