#pragma once

#include <string>

#include "config/rig.hpp"
#include "core/result.hpp"
#include "runtime/live_run.hpp"
#include "runtime/summary.hpp"

/// What a capture says when it has ended, and its exit status.
namespace hueline::apps {

/// How a capture ended.
struct Ending {
  bool is_cut = false;  ///< a second Ctrl-C ended it at once
  Status recorded;      ///< error of drive.mcap, with the number of packets that are whole and lost
  Status place;         ///< why drive.mcap is no longer where it was created
  Status finished;      ///< first error of the other files
};

/// Logs how many packets of each sensor are missing in the cloud or in the recording, and why.
void log_missing_packets(const config::Rig& rig, const runtime::LiveRun& run, bool is_cut);

/// Returns the error of the recording, with the number of packets that are whole and lost, or ok.
Status recorded_part(const runtime::LiveRun& run);

/// Adds to the summary what the pipeline did not see, and what went wrong with the recording at its end. A place that
/// was lost earlier is in the summary already.
void summarise(const Ending& ending, bool was_in_place, const config::Rig& rig, const runtime::LiveRun& run,
               runtime::Summary& summary);

/// Returns the command that makes cloud, view and summary of a recording whole, in its own folder.
std::string replay_of(const std::string& recording);

/// Logs the first file that is not whole. Returns the exit status, which is kDone if all files are whole.
int status_of_files(const Ending& ending, const runtime::LiveRun& run, const std::string& recording);

/// Logs which sources could not be read to their end, or that nothing came or could be placed. Returns the exit status.
int status_of_sources(const runtime::LiveRun& run, const runtime::Summary& summary, const std::string& recording);

}  // namespace hueline::apps
