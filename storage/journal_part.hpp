#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/journal_reader.hpp"

namespace hueline::storage {

/// The entry of a recording's header that says of which recording it is a part (JournalHeader::about).
inline constexpr const char* kPartOf = "part_of";

/// Which packets of a recording go into another one.
struct JournalPart {
  double from_s = 0;             ///< s after the first packet of the recording, as in the health and the verdict
  std::optional<double> to_s{};  ///< what comes then is left out; empty: to the end
  /// By SensorId, whether the sensor's packets are left out; may be shorter than the sensors. hueline's own are kept.
  std::vector<bool> left_out{};
  bool unpacks_images = false;  ///< packed images are stored as they came
};

/// Decides about each packet of a recording whether it belongs to the part, and which sequence it gets there.
/// Thread safety: none.
class PartChoice {
 public:
  enum class Fate : std::uint8_t { Keep, LeaveOut, Stop };

  explicit PartChoice(JournalPart part) : part_(std::move(part)) {}

  /// Takes the next packet of the recording. Stop: it and all that follow lie behind the part.
  Fate judge(const Packet& packet);
  /// Returns the sequence in the part of a packet that is kept. The sequence there begins at 0 and has the gaps of the
  /// recording.
  std::uint64_t sequence_of(const Packet& packet) const { return packet.sequence - first_ - of_others_ - ledgers_; }
  /// When the first packet of the recording came; before the first judge(), zero.
  HostTime begin() const { return begin_; }
  /// How long after it the newest packet so far came.
  nanoseconds newest() const { return newest_; }
  /// Packets left out so far: before the time, and of sensors that are left out. Those before the time are counted by
  /// their sequence once one is kept, so packets that the capture lost, and those that a reader passed over, count too.
  std::uint64_t before() const { return has_first_ ? first_ - begin_sequence_ : before_; }
  std::uint64_t of_others() const { return of_others_; }

 private:
  /// Whether packets get another sequence than they had.
  bool is_new_order() const;

  const JournalPart part_;
  bool has_begun_ = false, has_first_ = false;
  HostTime begin_{};
  nanoseconds newest_{0};
  std::uint64_t begin_sequence_ = 0;  // of the first packet of the recording
  std::uint64_t first_ = 0;           // sequence of the first packet of the time that is kept
  std::uint64_t before_ = 0, of_others_ = 0;
  std::uint64_t ledgers_ = 0;  // left out, because they count what is in the old recording
};

/// What was copied, and what was not.
struct CopiedPart {
  std::uint64_t packets = 0, bytes = 0;     ///< written, and bytes of their payloads
  std::uint64_t before = 0, of_others = 0;  ///< left out: see PartChoice
  bool ends_early = false;                  ///< the recording was not read to its end, because `to_s` was reached
  std::uint64_t damages = 0;                ///< damaged chunks that were skipped, and segments that are missing
  std::string first_damage;                 ///< why; empty if nothing was damaged
  Status end;                               ///< ok, or how the recording ends if it does not end well
};

/// Copies packets of a recording into a new one, which is whole, whatever state the old one is in. Packets keep bytes,
/// times and marks. Their sequence begins at 0 and has the gaps of the old one, so packets that the capture lost stay
/// missing and those that are left out do not. The ledgers of the old one are left out if sequences change. The header
/// says where the new one is from. Chunks before the time are passed over without reading them.
///
/// Errors: of the new file, which gets its name only when it is whole: until then an older file of that name stays;
/// Unsupported if there is nothing to write. The old file is only read.
Result<CopiedPart> copy_part(JournalReader& journal, const std::string& name, const JournalPart& part,
                             const std::filesystem::path& to);

/// Returns an Error of kind Invalid with the recording's duration if it ends before `from_s`. A recording whose
/// duration cannot be known without reading all of it is let pass, and so is one of an object storage, of which no more
/// than the part is to be fetched. Nothing of the recording must have been read yet; its first packet stays the next.
Status check_begin(JournalReader& journal, double from_s);

}  // namespace hueline::storage
