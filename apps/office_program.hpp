#pragma once

namespace hueline::apps {

/// Becomes `hueline-office`, which lies beside this program, with these words (argv, ended by a null). Comes back only
/// if it cannot be started: the exit status, after a sentence on standard error.
int run_office_program(char** argv);

}  // namespace hueline::apps
