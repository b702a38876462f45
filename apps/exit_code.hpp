#pragma once

#include "core/result.hpp"

namespace hueline::apps {

/// The program's exit statuses, the same for every command. `hueline --help` lists them.
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,           ///< an unexpected error; the message describes it
  kWrongUse = 2,         ///< the command line is wrong, or a rig, a scenario or a sheet is wrong or missing
  kInputUnreadable = 3,  ///< any other input could not be read, or only in part; the whole part was used
  kOutputRefused = 4,    ///< an output could not be written; what was written before is whole
  kNothingCame = 5,      ///< no device answered, no point could be made, or a cloud has none
  kNotAsExpected = 6,    ///< verify, score, replay --expect: a figure is out of its bound
  kStopped = 7,          ///< stopped before the end; the output ends early
  kDriveAgain = 8,       ///< capture, replay: the work is done, and the verdict is that the drive must be driven again
  kNotReady = 9,         ///< check: the drive must not start
};

/// Returns the exit status of a command that could not open its recording: either the given rig is wrong, or the
/// recording is.
inline int opening_status(const Error& error) {
  return error.code == ErrorCode::Invalid ? kWrongUse : kInputUnreadable;
}

}  // namespace hueline::apps
