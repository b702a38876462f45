#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "core/result.hpp"
#include "runtime/clock_survey.hpp"
#include "runtime/journal_merge.hpp"
#include "runtime/ledger.hpp"
#include "runtime/recording.hpp"
#include "storage/journal_header.hpp"

namespace hueline::apps {

/// The entry of a recording's header that says of which recordings it was made (JournalHeader::about).
inline constexpr const char* kMergedFrom = "merged_from";

/// What the user wants merged, and how the cases are decided that the recordings leave open.
struct MergeWish {
  std::vector<std::string> recordings;  ///< the first one's clock and ticks are kept
  config::Rig rig;                      ///< of the whole vehicle
  std::string rig_name;                 ///< for messages
  std::vector<std::string> without;     ///< names of sensors that are left out
  std::vector<std::string> take;        ///< "NAME=N": the sensor comes from the N-th recording, counted from 1
  bool is_same_clock = false;           ///< the recordings have one clock
  bool rig_decides = false;             ///< `rig` is right where a recording's own rig says otherwise of a sensor
};

/// From the first to the last `received` of some packets.
struct TimeSpan {
  HostTime first{}, last{};

  void add(HostTime time, bool is_first);
  /// Returns whether one ends before the other begins, or when it begins.
  bool is_apart_from(const TimeSpan& other) const { return last <= other.first || other.last <= first; }
};

/// A recording, read once from front to back.
struct SurveyedJournal {
  SurveyedJournal(std::string named, runtime::Recording opened);

  std::string name;  ///< as the user named it
  runtime::Recording recording;
  runtime::ClockSurvey clock;
  runtime::LedgerCheck check;
  std::vector<std::uint64_t> wire;  ///< packets of each sensor's device, by SensorId
  std::vector<TimeSpan> spans;      ///< of these packets, by SensorId
  TimeSpan span;                    ///< of all packets
  std::uint64_t packets = 0;
  bool begins_late = false;
};

/// Opens a recording and reads it. What is damaged in it is found again, and told, when it is merged. Errors: those of
/// Recording::open(); Stopped. `progress` is told the share that was read.
Result<SurveyedJournal> survey_journal(const std::string& name, const std::stop_token& stop,
                                       const std::function<void(double)>& progress = {});

/// How the recordings are joined.
struct MergePlan {
  std::vector<runtime::MergeInput> inputs;
  storage::JournalHeader header;      ///< of the new recording; its merge.json says what follows too
  std::vector<std::string> remarks;   ///< sentences about each recording: its clock, and which sensors come from it
  std::vector<std::string> warnings;  ///< what is unusual, and is done nevertheless
};

/// Decides which sensor comes from which recording, and how their clocks are related. Errors: Invalid, with what, where
/// and what to do, if the wish contradicts itself or leaves something open; Unsupported if the relation of the clocks
/// cannot be determined.
Result<MergePlan> plan_merge(const MergeWish& wish, std::vector<SurveyedJournal> journals);

}  // namespace hueline::apps
