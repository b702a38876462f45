#pragma once

#include "core/result.hpp"

namespace hueline::apps {

/// What the program's exit status means, the same for every command; `hueline --help` lists it.
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,           ///< something unforeseen; the message says what
  kWrongUse = 2,         ///< command line or configuration file
  kInputUnreadable = 3,  ///< an input could not be read, or only in part: what was whole has been used
  kOutputRefused = 4,    ///< an output could not be written; what was written before is whole
  kNothingCame = 5,      ///< no device answered, or no point could be made
  kNotAsExpected = 6,    ///< verify, score: a figure is out of its bound
  kStopped = 7,          ///< stopped before it was done: what it made ends early
};

/// The exit status of a command that could not open its recording: the rig that was given is wrong, or the recording
/// is.
inline int opening_status(const Error& error) {
  return error.code == ErrorCode::Invalid ? kWrongUse : kInputUnreadable;
}

}  // namespace hueline::apps
